"""Plots of docs/benchmarks from rows (pages.py). The same rows give the same bytes."""

import collections
import io
import math
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib import ticker  # noqa: E402
from matplotlib.transforms import Bbox  # noqa: E402

import pages  # noqa: E402

FOLDER = pages.PAGES / "plots"
# Okabe and Ito's, told apart by the colour-blind; yellow is too pale for a line.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#000000", "#E69F00", "#777777"]
MARKERS = "osD^vPX*"
STYLE = {
    "svg.hashsalt": "drench",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.markersize": 5,
}

# `like` is the number of the series whose colour and mark it has; "_" before a label leaves it out
# of the legend.
Series = collections.namedtuple(
    "Series", "label points notes dashed like", defaults=((), False, None)
)
Panel = collections.namedtuple("Panel", "title series bar", defaults=(None,))
Plot = collections.namedtuple("Plot", "name xlabel ylabel panels")
Bars = collections.namedtuple("Bars", "name xlabel values bar")  # values: (label, value)


def key(name, factor=1.0):
    def get(row):
        value = pages.value_of(row, name)
        return None if value is None else factor * value

    return get


cpu_s, percent_error = key("cpu_s"), key("error", 100)


def series_of(rows, label, x=cpu_s, y=percent_error, note=None):
    """Points of rows by the label that they get, in the order of the rows."""
    points = collections.OrderedDict()
    for row in rows:
        name = label(row)
        at = None if name is None else (x(row), y(row))
        if at and at[0] and at[1]:
            points.setdefault(name, []).append((at, note(row) if note else ""))
    return [
        Series(name, [p for p, _ in some], [n for _, n in some]) for name, some in points.items()
    ]


def method(row):
    return row["method"]


def matching(pattern, name=None):
    """The label of rows whose method matches: a group of it or `name`."""

    def label(row):
        found = re.search(pattern, row["method"])
        return None if not found else name or found[1]

    return label


def size_note(unit):
    return lambda row: f"{pages.size(row):g}{unit}"


# What is shown

TIME = "CPU s (user and system, all threads)"


def dam(rows, peers):
    """Beside the last run both runs of the comparison, in which Drench and the peer took turns."""

    def tolerance(row):
        return f"{row.get('tolerance_percent') or pages.derived['tolerance %'](row):g} %"

    def panel(title, error):
        series = series_of(rows, lambda row: "Drench", y=error, note=tolerance)
        for run in (1, 2):
            some = [row for row in peers if row["run"] == run]
            for like, one in enumerate(series_of(some, method, y=error, note=tolerance), 1):
                label = one.label if run == 1 else "_" + one.label
                notes = one.notes if run == 2 and like == 1 else ()
                series.append(one._replace(label=label, notes=notes, dashed=True, like=like))
        return Panel(title, series)

    tail = panel("99.9th percentile", key("percentile_99_9", 100))
    return Plot("fluid_dam", TIME, "density error, %", [panel("mean", percent_error), tail])


def sheets(of):
    pools = [
        Panel(
            f"{case}, particles across", series_of(of.get(case, []), method, note=size_note("")), 5
        )
        for case in ("sheet_pool", "strip_pool")
    ]
    curtain = series_of(of.get("sheet_curtain", []), pages.derived["pools"], note=size_note(""))
    return Plot(
        "sheets",
        TIME,
        "error of the sag or deflection, %",
        pools + [Panel("sheet_curtain, layers", curtain, 5)],
    )


def shells(rows):
    def panel(title, mesh):
        return Panel(title, series_of(rows, matching(rf"(.*), {mesh}")))

    return Plot(
        "shells",
        TIME,
        "error, %",
        [panel("right triangles", "right triangles"), panel("unstructured", "unstructured")],
    )


def viscous(rows):
    return Plot(
        "viscous",
        TIME,
        "worst L2 error of u over its largest, %",
        [
            Panel(
                f"{flow}, particles across",
                series_of(rows, matching(rf"{flow}, (.*)"), note=size_note("")),
                2,
            )
            for flow in ("Couette", "Poiseuille")
        ],
    )


FLOWS = {
    "flow_elliptical_drop": "strained drop: half axes",
    "flow_standing_wave": "standing wave: period",
    "flow_taylor_green": "Taylor-Green: decay rate",
    "fluid_martin_moyce": "dam break: front",
    "fluid_lobovsky": "impact: time",
    "wave_maker": "piston: height of waves",
    "fluid_rest": "at rest: pressure",
}


def flows(of):
    return Plot(
        "flows",
        TIME,
        "error, %",
        [
            Panel(name, series_of(of.get(case, []), lambda row: "_", note=size_note("")))
            for case, name in FLOWS.items()
        ],
    )


def surfaces(rows):
    return Plot(
        "surface_error",
        TIME,
        "scatter about the shape, spacings",
        [Panel("", series_of(rows, matching("^([^,]*),"), y=key("error")), 0.025)],
    )


def openvdb(rows):
    def panel(scene):
        some = [row for row in rows if row["resolution"].startswith(scene)]
        return Panel(
            scene,
            series_of(
                some,
                method,
                y=lambda row: 100 * abs(row["volume"] - 1),
                note=lambda row: re.search("voxel [0-9.]+", row["resolution"])[0],
            ),
        )

    return Plot(
        "surface_vs_openvdb", TIME, "error of the volume, %", [panel("ball"), panel("splash")]
    )


def samples_note(row):
    return f"{row['samples']:g}" if "samples" in row else ""


def convergence(of):
    cloth = series_of(
        of.get("render_convergence", []),
        lambda row: None if "slope" in row["method"] else row["method"],
        y=key("error"),
        note=samples_note,
    )
    caustics = series_of(
        of.get("render_caustics", []), matching("lamp, (.*)"), y=key("rel_mse"), note=samples_note
    )
    return Plot(
        "render_convergence",
        TIME,
        "relative MSE",
        [Panel("render_convergence", cloth), Panel("render_caustics: pool, small lamp", caustics)],
    )


def denoise(rows):
    series = []
    for picture in dict.fromkeys(pages.derived["picture"](row) for row in rows):
        some = [row for row in rows if pages.derived["picture"](row) == picture]
        raw = series_of(
            some,
            lambda row: "as rendered",
            x=key("noisy_cpu_s"),
            y=key("noisy_rel_mse"),
            note=samples_note,
        )
        done = series_of(some, lambda row: "denoised", y=key("error"), note=samples_note)
        series.append((picture, [raw[0]._replace(dashed=True)] + done))
    return Plot("render_denoise", TIME, "relative MSE", [Panel(*one) for one in series])


def lamps(rows):
    def count(row):
        return float(row["method"].split()[0])

    return Plot(
        "render_lamps",
        "lamps",
        "CPU time over that with one lamp",
        [Panel("", series_of(rows, matching("lamps, (.*)"), x=count, y=key("error")), 5)],
    )


def walks(rows):
    """Level water, which has no place on a logarithmic axis, stands at a millimetre."""

    def height(row):
        return float(re.search(r"of ([\d.]+) m", row["method"])[1]) or 1e-3

    def product(row):
        return row["rel_mse"] * row["cpu_s"]

    return Plot(
        "render_walks",
        "height of the waves, m (level water at 0.001)",
        "relative MSE x CPU s",
        [Panel("", series_of(rows, matching("m, (.*)"), x=height, y=product))],
    )


def cycles(rows):
    def panel(picture):
        some = [
            row
            for row in rows
            if row["method"].startswith(picture + ", ")
            and row["method"].endswith(("Cycles", "drench"))
        ]
        return Panel(
            picture,
            series_of(some, matching(", (Cycles|drench)$"), x=key("cpu_s"), y=key("rel_mse")),
        )

    pictures = dict.fromkeys(row["method"].rsplit(", ", 1)[0] for row in rows)
    return Plot("render_vs_cycles", TIME, "relative MSE", [panel(picture) for picture in pictures])


def scaling(of):
    fluid = series_of(
        of.get("fluid_scaling", []),
        lambda row: "incompressible, an iteration",
        x=pages.particles,
        y=key("ns_a_particle_iteration"),
    )
    surface = series_of(
        of.get("surface_scaling", []),
        lambda row: "surface, a frame",
        x=pages.particles,
        y=key("cpu_us_per_particle", 1000),
    )
    shell = series_of(
        of.get("shell_scaling", []),
        lambda row: None if "bar" in row["method"] else row["method"],
        x=pages.derived["triangles of sheets"],
        y=key("ns_a_triangle_step"),
    )
    return Plot(
        "scaling",
        "particles or triangles",
        "CPU ns a particle or triangle",
        [
            Panel("fluid_scaling", fluid),
            Panel("surface_scaling", surface),
            Panel("shell_scaling: a step", shell),
        ],
    )


def skips(of):
    """What there is and does nothing, gated or not, in per cent of the scene without it."""
    rows = [row for case in ("sim_skips", "render_skips") for row in of.get(case, [])]
    return Bars(
        "skips",
        "instructions added, % (0: what is absent or idle costs nothing)",
        [(row["method"].replace("_", " "), 100 * (row["error"] - 1)) for row in rows],
        1,
    )


def all_plots(of, peers):
    made = [dam(of["fluid_dam_64k"], peers)] if "fluid_dam_64k" in of else []
    for case, build in [
        ("shell_work_precision", shells),
        ("fluid_viscosity", viscous),
        ("surface_error", surfaces),
        ("surface_vs_openvdb", openvdb),
        ("render_denoise", denoise),
        ("render_lamps", lamps),
        ("render_walks", walks),
        ("render_vs_cycles", cycles),
    ]:
        if case in of:
            made.append(build(of[case]))
    made += [plot(of) for plot in (flows, sheets, convergence, scaling)]
    made = [plot._replace(panels=[panel for panel in plot.panels if panel.series]) for plot in made]
    return [plot for plot in made if plot.panels] + [bars for bars in [skips(of)] if bars.values]


# How it is drawn


def plain(value, _):
    """A tick's label: with k and M from ten thousand on, with a power of ten below a thousandth."""
    for unit, name in ((1e6, " M"), (1e3, " k")):
        if value >= max(unit, 1e4):
            return f"{value / unit:g}{name}"
    if value >= 0.99e-3:
        return f"{value:g}"
    power = math.floor(math.log10(value) + 1e-9)
    share = round(value / 10**power, 3)
    return f"$10^{{{power}}}$" if share == 1 else rf"${share:g}\cdot10^{{{power}}}$"


def draw_series(axes, one, number):
    x, y = zip(*one.points)
    number = number if one.like is None else one.like
    colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
    axes.loglog(
        x,
        y,
        "--" if one.dashed else "-",
        color=colour,
        marker=marker,
        label=one.label,
        linewidth=1 if one.dashed else 1.5,
        markerfacecolor="white" if one.dashed else colour,
    )
    for at, note in zip(one.points, one.notes):
        axes.annotate(
            note, at, (0, 0), textcoords="offset points", fontsize=7.5, color=colour, gid="note"
        )


# Points from a mark, and how the text is aligned there, from the first choice to the last.
NOTE_PLACES = [(4, 4, "left"), (-5, -9, "right"), (4, -9, "left"), (-5, 4, "right")]


def place_notes(figure, all_axes):
    """Where they are on no mark and no other note; what has no such place is left out."""
    figure.canvas.draw()
    for axes in all_axes:
        marks = [point for line in axes.lines for point in line.get_xydata()]
        taken = [
            Bbox.from_extents(x - 4, y - 4, x + 4, y + 4) for x, y in axes.transData.transform(marks)
        ]
        for note in axes.texts:
            if note.get_gid() != "note":
                continue
            for *offset, side in NOTE_PLACES:
                note.set(position=offset, horizontalalignment=side)
                box = note.get_window_extent()
                if not any(box.overlaps(other) for other in taken):
                    taken.append(box)
                    break
            else:
                note.set_visible(False)


def draw_panel(axes, panel):
    for number, one in enumerate(panel.series):
        draw_series(axes, one, number)
    if panel.bar:
        axes.axhline(panel.bar, color="#777777", linewidth=1, linestyle=":")
        axes.annotate(
            f"gate {panel.bar:g}",
            (0.01, panel.bar),
            xycoords=("axes fraction", "data"),
            xytext=(0, 3),
            textcoords="offset points",
            fontsize=7.5,
            color="#555555",
        )
    axes.set_title(panel.title)
    axes.margins(x=0.16, y=0.12)


def number_axis(axis):
    """Decades, and 2 and 5 of each where there are few."""
    low, high = axis.get_view_interval()
    if high / low < 100:
        axis.set_major_locator(
            ticker.LogLocator(subs=(1, 2, 5) if high / low > 5 else range(1, 10))
        )
        axis.set_minor_locator(ticker.NullLocator())
    axis.set_major_formatter(ticker.FuncFormatter(plain))


def draw_legends(all_axes, panels):
    """One beside the last panel where all have the same, else one under each."""
    labels = [[one.label for one in panel.series] for panel in panels]
    if labels[0] == ["_"]:
        return
    if all(some == labels[0] for some in labels):
        all_axes[-1].legend(fontsize=8.5, loc="center left", bbox_to_anchor=(1.02, 0.5))
        return
    for axes in all_axes:
        axes.legend(fontsize=8.5, loc="upper center", bbox_to_anchor=(0.5, -0.2))


def figure_of(plot):
    columns = min(len(plot.panels), 4)
    rows = -(-len(plot.panels) // columns)
    figure, grid = plt.subplots(
        rows,
        columns,
        figsize=(3.6 * columns + 2.4, 3.9 * rows),
        squeeze=False,
        sharey=True,
        constrained_layout=True,
    )
    all_axes = grid.flatten()[: len(plot.panels)]
    for unused in grid.flatten()[len(plot.panels) :]:
        unused.set_visible(False)
    for axes, panel in zip(all_axes, plot.panels):
        draw_panel(axes, panel)
        axes.set_xlabel(plot.xlabel)
        number_axis(axes.xaxis)
    number_axis(all_axes[0].yaxis)
    for first in grid[:, 0]:
        first.set_ylabel(plot.ylabel)
    draw_legends(all_axes, plot.panels)
    place_notes(figure, all_axes)
    return figure


def bars_of(bars):
    figure, axes = plt.subplots(
        figsize=(8.5, 0.6 + 0.21 * len(bars.values)), constrained_layout=True
    )
    labels, values = zip(*bars.values)
    axes.barh(range(len(values)), values, color=COLOURS[0], height=0.6)
    for at, value in enumerate(values):
        axes.annotate(
            f"{value:.3g}" if abs(value) >= 5e-3 else "0.00",
            (max(value, 0), at),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
        )
    axes.axvline(bars.bar, color="#777777", linewidth=1, linestyle=":")
    axes.set_xscale("symlog", linthresh=bars.bar)
    axes.set_xlim(right=3 * max(values))
    axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_yticks(range(len(labels)), labels, fontsize=8)
    axes.set_ylim(len(values) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel(bars.xlabel + f"; dotted: the bar of {bars.bar:g}")
    return figure


def svg_of(plot):
    with plt.rc_context(STYLE):
        figure = bars_of(plot) if isinstance(plot, Bars) else figure_of(plot)
        out = io.StringIO()
        figure.savefig(
            out,
            format="svg",
            facecolor="white",
            metadata={"Date": None, "Creator": f"matplotlib {matplotlib.__version__}"},
        )
        plt.close(figure)
    return re.sub(r" +$", "", out.getvalue(), flags=re.M)


def write(of, peers):
    FOLDER.mkdir(exist_ok=True)
    made = {f"{plot.name}.svg": svg_of(plot) for plot in all_plots(of, peers)}
    for name, text in made.items():
        (FOLDER / name).write_text(text)
    for file in FOLDER.glob("*.svg"):
        if file.name not in made:
            file.unlink()


def stale(of, peers):
    """Plots that are not there, or not what this version of matplotlib makes of the rows."""
    files = []
    for plot in all_plots(of, peers):
        file = FOLDER / f"{plot.name}.svg"
        text = file.read_text() if file.exists() else ""
        if not text or (f"matplotlib {matplotlib.__version__}<" in text and text != svg_of(plot)):
            files.append(file)
    return files
