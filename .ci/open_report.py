"""Opens a report in a headless browser and checks that every figure is drawn: open_report.py BROWSER REPORT CSV SCRATCH

A script is added to a copy of the page that looks for what each figure names: marks with the number of their sample, curves
and Pareto fronts with those of the samples that they join. All of them must be in sight, as many as the figure says; the
marks of every figure are of all samples of its scene, and the first figure of a scene has the curve of every series and the
front of every task of the table. Then the check is tried on pages with faults put in, which it must find."""

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
    // A line between two samples of one place is a point.
    const seen = (selector, least) => svg ? [...svg.querySelectorAll(selector)].filter(shape => {
      const box = shape.getBoundingClientRect(), style = getComputedStyle(shape);
      return box.width + box.height >= least && box.left >= frame.left - 1 && box.right <= frame.right + 1
        && box.top >= frame.top - 1 && box.bottom <= frame.bottom + 1
        && style.display !== "none" && style.visibility === "visible" && style.opacity > 0;
    }) : [];
    const text = svg ? [...svg.querySelectorAll("text")].filter(text => text.getBBox().width > 0) : [];
    const named = svg ? svg.dataset : {};
    return {scene: figure.dataset.scene, samples: Number(figure.dataset.samples), width: frame.width, height: frame.height,
      extent: [extent.width, extent.height], texts: text.length,
      named: {marks: Number(named.marks), curves: Number(named.curves), fronts: Number(named.fronts)},
      marks: seen(".mark", 1).map(mark => Number(mark.dataset.sample)),
      curves: seen(".curve", 0).map(curve => curve.dataset.samples),
      fronts: seen(".front", 0).map(front => front.dataset.samples)};
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


def expected(rows):
    """Per scene: how many samples, those with a place on logarithmic axes, and the samples of each series and each front."""
    scenes = {}
    for row in rows:
        scene = scenes.setdefault(row["scene"], {"samples": 0, "series": {}, "tasks": {}})
        number, error = scene["samples"], float(row["error_l2"])
        scene["samples"] += 1
        task = row["dim"], row["set"]
        scene["tasks"].setdefault(task, []).append((float(row["total_s"]), error, number))
        if error > 0:
            series = *task, row["method"], row["order"], row["stepper"], row["scalar"]
            scene["series"].setdefault(series, []).append(number)
    for scene in scenes.values():
        scene["drawn"] = {number for series in scene["series"].values() for number in series}
        scene["curves"] = {joined(series) for series in scene["series"].values() if len(series) > 1}
        fronts = [[number for number in front(task) if number in scene["drawn"]] for task in scene["tasks"].values()]
        scene["fronts"] = {joined(numbers) for numbers in fronts if len(numbers) > 1}
    return scenes


def joined(numbers):
    return " ".join(map(str, numbers))


def front(samples):
    """The numbers of those that no other is both faster and better than."""
    best, least = [], float("inf")
    for _, error, number in sorted(samples):
        if error < least:
            best.append(number)
            least = error
    return best


def faults(figures, scenes):
    """What is wrong with them, for what is expected of each scene."""
    wrong = []
    for name, scene in scenes.items():
        of_scene = [figure for figure in figures if figure["scene"] == name]
        if not of_scene:
            wrong.append(f"{name}: no figure")
        for place, figure in enumerate(of_scene):
            if figure["samples"] != scene["samples"]:
                wrong.append(f"{name}: made for {figure['samples']} samples, the table has {scene['samples']}")
            if min(figure["width"], figure["height"], *figure["extent"]) < 100:
                wrong.append(f"{name}: {figure['width']} by {figure['height']} pixels, extent {figure['extent']}")
            if set(figure["marks"]) != scene["drawn"]:
                odd = sorted(set(figure["marks"]) ^ scene["drawn"])
                wrong.append(f"{name}: {len(odd)} samples without a mark or marks without a sample, the first {odd[0]}")
            for kind, found in (("marks", len(figure["marks"])), ("curves", len(figure["curves"])),
                                ("fronts", len(figure["fronts"]))):
                if found != figure["named"][kind]:
                    wrong.append(f"{name}: {found} {kind} in sight, {figure['named'][kind]} are drawn")
            if place == 0:
                for kind, found in (("curves", figure["curves"]), ("fronts", figure["fronts"])):
                    missed = scene[kind] ^ set(found)
                    if missed:
                        wrong.append(f"{name}: {len(missed)} {kind} differ from the table, such as of samples {min(missed)}")
            if figure["texts"] < 10:
                wrong.append(f"{name}: {figure['texts']} labels in sight")
    return wrong


def main():
    browser, report, table, scratch = sys.argv[1:]
    page = pathlib.Path(report).read_text(encoding="utf-8")
    with open(table, newline="", encoding="utf-8") as rows:
        scenes = expected(csv.DictReader(rows))
    if re.search(r"""(src|href)\s*=|url\(|@import|<script""", page):
        raise SystemExit("the page loads something")
    figures = measured(browser, page, scratch)
    for figure in figures:
        print(f"{figure['scene']}: {figure['width']:.0f} by {figure['height']:.0f} pixels, {figure['samples']} samples: "
              f"{len(figure['marks'])} marks, {len(figure['curves'])} curves, {len(figure['fronts'])} fronts")
    wrong = faults(figures, scenes)
    if not scenes or wrong:
        raise SystemExit("\n".join(wrong) or "the table is empty")

    # The check must be able to fail.
    mark = r'<\w+ class="mark"[^>]*/>'
    spoiled = {
        "a figure left out": re.sub(r"<figure.*?</figure>", "", page, count=1, flags=re.DOTALL),
        "an empty drawing": re.sub(r"(<figure[^>]*>\s*<svg[^>]*>).*?(</svg>)", r"\1\2", page, count=1, flags=re.DOTALL),
        "a drawing without marks": re.sub(mark, "", page),
        "a drawing out of sight": page.replace("figure svg{", "figure svg{display:none;"),
        "one mark left out": re.sub(mark, "", page, count=1),
        "one mark moved out of the frame": page.replace('class="mark"', 'class="mark" transform="translate(9999)"', 1),
        "curves left out": re.sub(r'<polyline class="curve"[^>]*/>', "", page),
        "one curve left out": re.sub(r'<polyline class="curve"[^>]*/>', "", page, count=1),
        "Pareto fronts left out": re.sub(r'<g class="front".*?</g>', "", page, flags=re.DOTALL),
        "one Pareto front left out": re.sub(r'<g class="front".*?</g>', "", page, count=1, flags=re.DOTALL),
    }
    for name, text in spoiled.items():
        if text == page or not faults(measured(browser, text, scratch), scenes):
            raise SystemExit(f"{name} is not found")
    print(f"{len(figures)} figures drawn; {len(spoiled)} faults put in and found")


main()
