#!/usr/bin/env python3
"""Pages of docs/benchmarks from the rows that ./bench --record keeps (results.jsonl).

    pages.py                   plots, tables, validation.md, runs.md; build/benchmarks.html
    pages.py --check pages     whether rows are valid and the pages say what the rows do
    pages.py --check plots     the same of plots, by the version of Matplotlib that made them
    pages.py --validate FILE   whether the rows of another file are valid

A table of a page stands between two comments, of which the first says what is in it:

    <!-- rows: CASE [METHOD]; HEADING = [FACTOR] KEY; ... -->
    <!-- end -->

METHOD is a regular expression that the rows' method holds. KEY is a key of the rows or one of
`derived`. `HEADING = by KEY` puts all rows of one such value into one line. CASE may be `peers`,
for the rows of other programs (peers.jsonl). Of each case the last full run counts, or the last
quick one where there is no full one.
"""

import argparse
import collections
import json
import math
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs/benchmarks"
RESULTS = PAGES / "results.jsonl"
PEERS = PAGES / "peers.jsonl"

SKIPPED = 77  # the exit status of a test that is left out
ORIGIN = ["time", "commit", "machine", "command"]
RESULT = [
    "case",
    "method",
    "resolution",
    "time_step",
    "device",
    "threads",
    "wall_s",
    "cpu_s",
    "peak_mib",
    "error",
    "error_of",
    "gate",
    "pass",
]


# Rows


def finite(value):
    if isinstance(value, dict):
        return all(map(finite, value.values()))
    if isinstance(value, list):
        return all(map(finite, value))
    return not isinstance(value, float) or math.isfinite(value)


def faults_of(row):
    """What is wrong with a row, in words."""
    faults = [f"no {key}" for key in ORIGIN + RESULT if key not in row]
    if faults:
        return faults
    if not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", row["time"]):
        faults.append("time is not UTC")
    if not re.fullmatch(r"[0-9a-f]{7,}\+?", row["commit"]):
        faults.append("commit is no hash")
    if row["command"] not in (f"./bench {row['case']}", f"./bench --quick {row['case']}"):
        faults.append("command is not that of its case")
    if not finite(row):
        faults.append("a number is not finite")
    kept = row["gate"] is not None and row["error"] is not None and row["error"] <= row["gate"]
    if row["pass"] != (None if row["gate"] is None else kept):
        faults.append("pass is not what error and gate say")
    return faults


def read_lines(file):
    return [
        json.loads(line, parse_constant=lambda name: math.nan)
        for line in file.read_text().splitlines()
    ]


def read_rows(file):
    """Ends the program with status 1 at a row that is not as it should be."""
    rows = read_lines(file)
    for number, row in enumerate(rows, 1):
        if faults_of(row):
            sys.exit(f"{file}:{number}: {', '.join(faults_of(row))}")
    return rows


def runs_of(rows):
    """Runs of each case, oldest first: {case: [rows of one run]}."""
    runs = collections.defaultdict(dict)
    for row in rows:
        runs[row["case"]].setdefault((row["time"], row["command"]), []).append(row)
    return {case: [of[key] for key in sorted(of)] for case, of in sorted(runs.items())}


def latest(rows):
    """{case: rows of its last run}, a full one if there is one."""

    def weight(run):
        return "--quick" not in run[0]["command"], run[0]["time"]

    return {case: max(runs, key=weight) for case, runs in runs_of(rows).items()}


# Values


def number_before(unit, *keys):
    """A number that stands before a word in one of the row's texts."""

    def find(row):
        for key in keys:
            found = re.search(rf"([\d.]+) {unit}", row[key] or "")
            if found:
                return float(found[1])
        return None

    return find


def particles(row):
    found = re.search(r"(\d+) particles|(?:across|layers), (\d+)$", row["resolution"] or "")
    return float(found[1] or found[2]) if found else None


def size(row):
    """What says how fine a run is: particles, cells or layers across what matters, samples."""
    if "samples" in row:
        return float(row["samples"])
    units = r"(?:layers|across|cells|rings|to the|over the|spacings (?:of|to))"
    return (
        number_before(units, "resolution")(row)
        or particles(row)
        or number_before("triangles", "resolution")(row)
    )


def short(text):
    """Its decimals without zeros at their ends."""
    return re.sub(r"\d+\.\d+", lambda found: f"{float(found[0]):g}", text)


derived = {
    "size": size,
    "particles": particles,
    "triangles of sheets": number_before("triangles", "resolution"),
    "tolerance %": number_before("%", "method"),
    "light by": lambda row: row["method"].rpartition(", ")[2],
    "pools": lambda row: short(row["method"]),
    "added %": lambda row: 100 * (row["error"] - 1),
    "picture": lambda row: (row["method"] or "").split(",")[0],
}


def value_of(row, key):
    if key in row:
        return row[key]
    if key in derived:
        return derived[key](row)
    at = row
    for part in key.split("/"):
        at = at.get(part) if isinstance(at, dict) else None
    return at


def text_of(value):
    if value is None:
        return ""
    if isinstance(value, bool):
        return "met" if value else "**not met**"
    if isinstance(value, str):
        return value
    if isinstance(value, list):
        return ", ".join(map(text_of, value))
    if value == int(value) and abs(value) < 1e9:
        return f"{int(value):,}"
    if 1e-3 <= abs(value) < 1000:
        return f"{value:.3g}"
    return f"{value:,.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.1e}".replace("e-0", "e-")


# Tables


def lined(heads, lines):
    table = ["| " + " | ".join(heads) + " |", "|" + " --- |" * len(heads)]
    return table + ["| " + " | ".join(line) + " |" for line in lines]


def column(spec):
    """Of "HEADING = [by] [FACTOR] KEY"."""
    heading, _, key = (part.strip() for part in spec.rpartition("="))
    grouped = key.startswith("by ")
    key = key[3:] if grouped else key
    found = re.fullmatch(r"(-?[\d.e]+) (.+)", key)
    return heading, grouped, float(found[1]) if found else 1.0, found[2] if found else key


def cell(row, factor, key):
    value = value_of(row, key)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        value *= factor
    if isinstance(value, list):
        value = [factor * one for one in value]
    return text_of(value)


def table_of(spec, of_case):
    """The lines of a table by its comment."""
    head, *specs = (part.strip() for part in spec.split(";"))
    case, _, method = head.partition(" ")
    if case not in of_case:
        return [f"There is no row of `{case}` yet."]
    rows = [row for row in of_case[case] if re.search(method, row["method"] or "")]
    columns = [column(spec) for spec in specs]
    groups = collections.OrderedDict()
    for row in rows:
        key = tuple(cell(row, f, k) for _, grouped, f, k in columns if grouped) or id(row)
        groups.setdefault(key, []).append(row)
    lines = []
    for group in groups.values():
        line = []
        for _, grouped, factor, key in columns:
            cells = [cell(row, factor, key) for row in group]
            line.append(
                cells[0] if grouped or len(set(cells)) == 1 else ", ".join(filter(None, cells))
            )
        lines.append(line)
    first = rows[0]
    return lined([heading for heading, *_ in columns], lines) + ["", source_of(first)]


def source_of(row):
    if "source" in row:
        return f"{row['source'][0].upper()}{row['source'][1:]}."
    date, commit, machine, command = (row[key] for key in ("time", "commit", "machine", "command"))
    return f"Measured {date[:10]} at {commit} on {machine}: `{command}`."


def with_tables(text, of_case):
    def replace(found):
        return found[1] + "\n" + "\n".join(table_of(found[2], of_case)) + "\n<!-- end -->"

    return re.sub(r"(<!-- rows: (.*?) -->)\n.*?<!-- end -->", replace, text, flags=re.S)


# Validation

Claim = collections.namedtuple("Claim", "case page what source method")
CLOSED, LINEAR, EXPERIMENT = "closed form", "linear theory", "experiment"
CLAIMS = [
    Claim(*claim)
    for claim in [
        ("fluid_rest", "fluid.md", "pressure of water at rest", "p = rho g depth", ""),
        (
            "fluid_martin_moyce",
            "fluid.md",
            "front of a dam break",
            "Martin and Moyce 1952, " + EXPERIMENT,
            "",
        ),
        (
            "fluid_lobovsky",
            "boundaries.md",
            "time of a wave's impact",
            "Lobovsky et al. 2014, " + EXPERIMENT,
            "",
        ),
        ("flow_elliptical_drop", "flows.md", "drop in a straining flow", CLOSED, ""),
        ("flow_standing_wave", "flows.md", "period of a standing wave", LINEAR, ""),
        (
            "flow_taylor_green",
            "flows.md",
            "decay of vortices, Re = 100",
            CLOSED + " (Taylor and Green 1937)",
            "",
        ),
        ("fluid_viscosity", "flows.md", "start of Couette flow", "series", "Couette"),
        ("fluid_viscosity", "flows.md", "start of Poiseuille flow", "series", "Poiseuille"),
        ("fluid_viscosity", "flows.md", "spreading block", "Huppert 1982", "Huppert"),
        (
            "fluid_drop",
            "flows.md",
            "drop with surface tension",
            "Rayleigh's period, Laplace's pressure",
            "",
        ),
        ("wave_maker", "boundaries.md", "waves of a piston", LINEAR, ""),
        (
            "fluid_body_drag",
            "boundaries.md",
            "trough under a sliding plane",
            "lubrication limit",
            "trough",
        ),
        (
            "fluid_body_drag",
            "boundaries.md",
            "film on a slope",
            "Nusselt's film",
            "film|floor|slope",
        ),
        ("obstacle_buoyancy", "boundaries.md", "buoyancy", "Archimedes", ""),
        (
            "sheet_pool",
            "coupling.md",
            "sag of a sheet under a pool",
            "its own static solution, in double",
            "",
        ),
        ("strip_pool", "coupling.md", "the same, plane", "its own static solution, in double", ""),
        (
            "sheet_curtain",
            "coupling.md",
            "curtain between two pools",
            "its own static solution, in double",
            "",
        ),
        (
            "coupled_momentum",
            "coupling.md",
            "momentum of water and a free sheet",
            "conservation",
            "",
        ),
        ("shell_work_precision", "cloth.md", "shells", CLOSED, ""),
        ("fabric_drape", "cloth.md", "drape coefficient", "measured bands", ""),
        ("shell_in_water", "coupling.md", "plate under water", CLOSED, "plate"),
        (
            "shell_in_water",
            "coupling.md",
            "elastic gate",
            "Antoci et al. 2007, " + EXPERIMENT,
            "gate",
        ),
        ("surface_error", "../theory/surfacing.md", "surface of five shapes", CLOSED, ""),
        ("render_leaks", "rendering.md", "rays that leave a closed body", "none may", ""),
    ]
]


def order_of(rows):
    """Least squares slope of log error over log size; none unless the error falls at each size."""
    points = [(size(row), row["error"]) for row in rows if size(row)]
    points = sorted(points)
    if len(points) < 2 or any(a <= b or not b for (_, a), (_, b) in zip(points, points[1:])):
        return None
    points = [(math.log(n), math.log(error)) for n, error in points]
    mx, my = (sum(axis) / len(points) for axis in zip(*points))
    return -sum((x - mx) * (y - my) for x, y in points) / sum((x - mx) ** 2 for x, _ in points)


def validation_line(claim, method, rows):
    gates = [row["pass"] for row in rows if row["gate"] is not None]
    verdict = "met" if gates else ""
    if not all(gates):
        verdict = f"**not met** by {gates.count(False)} of {len(gates)}"
    order = order_of(rows)
    gate = next((row["gate"] for row in reversed(rows) if row["gate"] is not None), None)
    first = rows[0]
    return [
        f"[{claim.what}]({claim.page})" + (f": {short(method)}" if method else ""),
        claim.source,
        ", ".join(text_of(size(row)) for row in rows),
        ", ".join(text_of(row["error"]) for row in rows),
        "" if order is None else f"{order:.1f}",
        text_of(gate),
        verdict,
        f"`{first['command']}`, {first['commit']}",
    ]


def validation(of_case):
    lines, missing = [], []
    for claim in CLAIMS:
        groups = collections.OrderedDict()
        for row in of_case.get(claim.case, []):
            if row["error"] is not None and re.search(claim.method, row["method"] or ""):
                groups.setdefault((row["method"], row["error_of"]), []).append(row)
        if not groups:
            missing.append(f"`{claim.case}`")
        for (method, _), rows in groups.items():
            lines.append(validation_line(claim, method if len(groups) > 1 else "", rows))
    heads = ["what", "against", "sizes", "errors", "order", "gate", "verdict", "command, commit"]
    return page(
        "Validation",
        """
What Drench computes against what is known, one line a claim. Errors are relative unless their page
says otherwise; what exactly each is an error of stands in its rows, under `error_of`. Sizes are
particles, cells or layers across what matters. The order is the slope of a line fitted to the
errors over the sizes, both logarithmic: 1 halves the error where the size doubles. It is left out
where an error does not fall: there it is chance, or at a floor. A gate is the largest error that a case allows; some
cases set it for their finest size alone.""",
        lined(heads, lines)
        + (["", "Not recorded: " + ", ".join(dict.fromkeys(missing)) + "."] if missing else []),
    )


# Runs


def run_line(run):
    first = run[0]
    gated = [row for row in run if row["gate"] is not None]
    shares = [
        row["error"] / row["gate"] for row in gated if row["gate"] and row["error"] is not None
    ]
    cpu_s = sum(row["cpu_s"] or 0 for row in run)
    kept = sum(row["pass"] for row in gated)
    return [
        f"`{first['command']}`",
        first["time"][:16].replace("T", " "),
        first["commit"],
        str(len(run)),
        text_of(cpu_s or None),
        text_of(max(shares, default=None)),
        f"{kept} of {len(gated)}" if gated else "",
    ]


def all_cases():
    """Of ./bench, as its sources register them."""
    texts = [file.read_text() for file in sorted((ROOT / "tests/bench").glob("*_case*.cpp"))]
    return sorted(re.findall(r'Registration \w+\{\s*"(\w+)"', "".join(texts)))


def runs_page(rows):
    lines = [run_line(run) for runs in runs_of(rows).values() for run in reversed(runs)]
    without = [f"`{case}`" for case in all_cases() if case not in runs_of(rows)]
    heads = ["command", "UTC", "commit", "rows", "CPU s", "worst error over its gate", "gates met"]
    return page(
        "Runs",
        """
Every run that is recorded, of each case the last one first: its lines are its history. CPU seconds
are the sum of what the rows measured, which leaves references and setting up out.""",
        lined(heads, lines) + ["", "No run yet: " + ", ".join(without) + "."],
    )


def page(title, prose, lines):
    mark = "<!-- made by ./bench --pages from results.jsonl -->"
    prose = " ".join(prose.split())
    return "\n".join([f"# {title}", "", mark, "", prose, ""] + lines) + "\n"


def texts(rows):
    """{file: its text as the rows have it}."""
    of_case = {**latest(rows), "peers": read_lines(PEERS)}
    files = {PAGES / "validation.md": validation(of_case), PAGES / "runs.md": runs_page(rows)}
    for file in sorted(ROOT.glob("docs/**/*.md")):
        if "<!-- rows: " in file.read_text():
            files[file] = with_tables(file.read_text(), of_case)
    return files


def stale_pages(rows):
    return [
        file for file, text in texts(rows).items() if not file.exists() or file.read_text() != text
    ]


def stale_plots(rows):
    try:
        import plots
    except ImportError:
        print("pages: no matplotlib, so plots are not compared", file=sys.stderr)
        sys.exit(SKIPPED)
    return plots.stale(latest(rows), read_lines(PEERS))


def check(what, rows):
    """@return the exit status: 1 where a page or plot says something else than the rows."""
    stale = stale_pages(rows) if what == "pages" else stale_plots(rows)
    for file in stale:
        print(f"{file.relative_to(ROOT)} is not what rows make: ./bench --pages", file=sys.stderr)
    return 1 if stale else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--check", choices=["pages", "plots"], help="only compare, change nothing")
    parser.add_argument(
        "--validate", type=pathlib.Path, metavar="FILE", help="only read these rows"
    )
    parser.add_argument("--html", type=pathlib.Path, help="a page of all plots and tables")
    arguments = parser.parse_args()
    if arguments.validate:
        return 0 if read_rows(arguments.validate) else 1
    rows = read_rows(RESULTS)
    if arguments.check:
        return check(arguments.check, rows)
    for file, text in texts(rows).items():
        file.write_text(text)
    import plots

    plots.write(latest(rows), read_lines(PEERS))
    if arguments.html:
        import html_page

        html_page.write(arguments.html, PAGES)
    return 0


if __name__ == "__main__":
    sys.exit(main())
