"""Reads the VTU and PVD files in a folder with meshio and compares them with the lines `vtu ..` and `pvd ..` of a log."""

import math
import sys
from pathlib import Path
from xml.etree import ElementTree

import meshio

folder, log = Path(sys.argv[1]), Path(sys.argv[2]).read_text().splitlines()
told = {kind: [line.split()[1:] for line in log if line.startswith(kind + " ")] for kind in ("vtu", "pvd")}
for kind, entries in told.items():
    found = {path.name for path in folder.glob("*." + kind)}
    assert entries and found == {entry[0] for entry in entries}, (kind, found, entries)

for name, count, *sums in told["vtu"]:
    mesh = meshio.read(folder / name)
    assert len(mesh.points) == int(count) and [len(block.data) for block in mesh.cells] == [int(count)], name
    assert set(mesh.point_data) == {field.split("=")[0] for field in sums}, name
    for field, total in (entry.split("=") for entry in sums):
        values = mesh.point_data[field].ravel()
        rounding = len(values) * 2.0**-52 * math.fsum(map(abs, values))
        assert abs(math.fsum(values) - float(total)) <= rounding, (name, field, math.fsum(values), total)

for name, *entries in told["pvd"]:
    sets = ElementTree.parse(folder / name).getroot().findall("Collection/DataSet")
    assert [f"{s.get('timestep')}={s.get('file')}" for s in sets] == entries, name
    for data in sets:
        meshio.read(folder / data.get("file"))

print("read", ", ".join(f"{len(entries)} {kind}" for kind, entries in told.items()))
