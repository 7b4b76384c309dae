"""Meshes in files: scanned motion as sources, bodies as targets, answers as mesh sequences.

Reads PLY, OBJ, GLB, STL and OFF through trimesh, which the extra ``mesh`` installs.
"""

from retarget_bench.motion.scans.importing import ImportedBody as ImportedBody
from retarget_bench.motion.scans.importing import ImportedScan as ImportedScan
from retarget_bench.motion.scans.importing import load_body as load_body
from retarget_bench.motion.scans.importing import load_scan as load_scan
from retarget_bench.motion.scans.reading import SUFFIXES as SUFFIXES
from retarget_bench.motion.scans.reading import is_scan as is_scan
from retarget_bench.motion.scans.writing import write_frames as write_frames
