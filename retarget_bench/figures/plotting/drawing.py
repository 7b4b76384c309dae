"""Drawing a figure of charts into a file."""

from pathlib import Path

from retarget_bench.figures.data.model import (
    BoxChart,
    Figure,
    HeatMap,
    LineChart,
    PointChart,
    RowChart,
    SkeletonChart,
)
from retarget_bench.figures.plotting import bodies, canvas, curves

BACKENDS = {
    LineChart: curves.lines,
    RowChart: curves.rows,
    PointChart: curves.points,
    BoxChart: curves.boxes,
    HeatMap: bodies.maps,
    SkeletonChart: bodies.skeletons,
}


def draw(path: Path, data: Figure, page: canvas.Page = canvas.PAGE) -> None:
    """Draw a figure, all of whose charts are of one kind. Raises BenchError for a file of an unknown
    kind."""
    BACKENDS[type(data.charts[0])](path, data, page)
