"""Opens a report in a headless browser and checks that every figure is drawn: open_report.py BROWSER REPORT CSV SCRATCH

A script is added to a copy of the page that measures each figure once the page has loaded. A scene of the table without
a figure, a figure that takes no room, or one with fewer marks in sight than its scene has samples is a fault. Then the
check is tried on pages with faults put in, which it must find."""

import collections
import csv
import html
import json
import pathlib
import re
import subprocess
import sys
import tempfile

MEASURE = """
<script>
addEventListener("load", () => {
  const found = [...document.querySelectorAll("figure")].map(figure => {
    const svg = figure.querySelector("svg");
    const frame = svg ? svg.getBoundingClientRect() : {width: 0, height: 0};
    const extent = svg ? svg.getBBox() : {width: 0, height: 0};
    // A mark is a small filled shape: backgrounds, frames and axes are not.
    const marks = svg ? [...svg.querySelectorAll("circle, polygon, rect, line")].filter(shape => {
      const box = shape.getBoundingClientRect();
      return box.width > 0 && box.height > 0 && box.width < 40 && box.height < 40
        && box.left >= frame.left && box.right <= frame.right
        && box.top >= frame.top && box.bottom <= frame.bottom
        && getComputedStyle(shape).display !== "none";
    }) : [];
    const text = svg ? [...svg.querySelectorAll("text")].filter(text => text.getBBox().width > 0) : [];
    return {scene: figure.dataset.scene, samples: Number(figure.dataset.samples), width: frame.width, height: frame.height,
      extent: [extent.width, extent.height], marks: marks.length, texts: text.length};
  });
  const result = document.createElement("pre");
  result.id = "measured";
  result.textContent = JSON.stringify(found);
  document.body.append(result);
});
</script>
"""

FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--window-size=1600,1200", "--dump-dom"]


def measured(browser, page, scratch):
    """What the browser finds of each figure."""
    with tempfile.TemporaryDirectory(dir=scratch) as profile:
        copy = pathlib.Path(profile, "page.html").resolve()
        copy.write_text(page.replace("</body>", MEASURE + "</body>"), encoding="utf-8")
        command = [browser, *FLAGS, f"--user-data-dir={profile}/data", copy.as_uri()]
        dom = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    result = re.search(r'<pre id="measured">(.*?)</pre>', dom, re.DOTALL)
    if not result:
        raise SystemExit("the page did not load to its end")
    return json.loads(html.unescape(result.group(1)))


def faults(figures, scenes):
    """What is wrong with them, for the number of samples of each scene."""
    wrong = []
    for scene, samples in scenes.items():
        of_scene = [figure for figure in figures if figure["scene"] == scene]
        if not of_scene:
            wrong.append(f"{scene}: no figure")
        for figure in of_scene:
            if figure["samples"] != samples:
                wrong.append(f"{scene}: made for {figure['samples']} samples, the table has {samples}")
            if min(figure["width"], figure["height"], *figure["extent"]) < 100:
                wrong.append(f"{scene}: {figure['width']} by {figure['height']} pixels, extent {figure['extent']}")
            if figure["marks"] < samples:
                wrong.append(f"{scene}: {figure['marks']} marks in sight for {samples} samples")
            if figure["texts"] < 10:
                wrong.append(f"{scene}: {figure['texts']} labels in sight")
    return wrong


def main():
    browser, report, table, scratch = sys.argv[1:]
    page = pathlib.Path(report).read_text(encoding="utf-8")
    with open(table, newline="", encoding="utf-8") as rows:
        scenes = collections.Counter(row["scene"] for row in csv.DictReader(rows))
    if re.search(r"""(src|href)\s*=|url\(|@import|<script""", page):
        raise SystemExit("the page loads something")
    figures = measured(browser, page, scratch)
    for figure in figures:
        print(f"{figure['scene']}: {figure['width']:.0f} by {figure['height']:.0f} pixels, "
              f"{figure['marks']} marks for {figure['samples']} samples")
    wrong = faults(figures, scenes)
    if not scenes or wrong:
        raise SystemExit("\n".join(wrong) or "the table is empty")

    # The check must be able to fail.
    spoiled = {
        "a figure left out": re.sub(r"<figure.*?</figure>", "", page, count=1, flags=re.DOTALL),
        "an empty drawing": re.sub(r"(<figure[^>]*>\s*<svg[^>]*>).*?(</svg>)", r"\1\2", page, count=1, flags=re.DOTALL),
        "a drawing without marks": re.sub(r"<(circle|polygon|rect|line) [^>]*/>", "", page),
        "a drawing out of sight": page.replace("figure svg{", "figure svg{display:none;"),
    }
    for name, text in spoiled.items():
        if text == page or not faults(measured(browser, text, scratch), scenes):
            raise SystemExit(f"{name} is not found")
    print(f"{len(figures)} figures drawn; {len(spoiled)} faults put in and found")


main()
