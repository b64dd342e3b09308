"""One self-contained page of all plots, and of the tables that ./bench --pages makes."""

import html
import re

STYLE = """body{font:15px/1.5 sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}
figure{margin:2em 0}figure svg{max-width:100%;height:auto}figcaption{font-weight:bold}
table{border-collapse:collapse;font-size:13px}td,th{border-bottom:1px solid #ddd;padding:.3em .6em;
text-align:left;vertical-align:top}code{background:#f4f4f4}"""


def inline(text):
    """Of Markdown: code, bold, and links, of which the text stays."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", html.escape(text))
    text = re.sub(r"`([^`]*)`", r"<code>\1</code>", text)
    return re.sub(r"\*\*(.*?)\*\*", r"<b>\1</b>", text)


def row(line, tag):
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    return "<tr>" + "".join(f"<{tag}>{inline(cell)}</{tag}>" for cell in cells) + "</tr>"


def body_of(markdown):
    """Headings, paragraphs and tables: what the made pages consist of."""
    out = []
    for block in re.split(r"\n\n+", markdown):
        lines = [line for line in block.strip().splitlines() if not line.startswith("<!--")]
        if not lines:
            continue
        if lines[0].startswith("|"):
            out.append(
                "<table>"
                + row(lines[0], "th")
                + "".join(row(one, "td") for one in lines[2:])
                + "</table>"
            )
        elif lines[0].startswith("# "):
            out.append(f"<h2>{inline(lines[0][2:])}</h2>")
        else:
            out.append(f"<p>{inline(' '.join(lines))}</p>")
    return "\n".join(out)


def figure(file, number):
    svg = file.read_text()
    svg = svg[svg.index("<svg") :]
    # Marks that lines share are named in each file; in one document names have to differ.
    svg = re.sub(r'(id="|href="#|url\(#)', rf"\g<1>p{number}-", svg)
    return f"<figure><figcaption>{file.stem}</figcaption>{svg}</figure>"


def write(file, pages):
    plots = sorted((pages / "plots").glob("*.svg"))
    text = [
        "<!doctype html><meta charset=utf-8><title>Drench: benchmarks</title>",
        f"<style>{STYLE}</style><h1>Drench: time and error</h1>",
    ]
    text += [figure(plot, number) for number, plot in enumerate(plots)]
    text += [body_of((pages / name).read_text()) for name in ("validation.md", "runs.md")]
    file.write_text("\n".join(text))
