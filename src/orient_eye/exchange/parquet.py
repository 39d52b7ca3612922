"""Columns of Parquet files, written and read.

write_parquet("saccades.parquet", trajectory)     # one row a sample; column saccade, then those of the CSV
"""

import io
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.files import unreadable, write_atomically
from orient_eye.movement.trajectory import Trajectory
from orient_eye.tables import Table, listed

Array = NDArray[np.float64]
MAGIC = b"PAR1"
_HINT = "give a Parquet file of columns of numbers"
_MOST = 50_000_000  # rows


def write_parquet(path: str | Path, trajectory: Trajectory) -> Path:
    """Write all saccades of a batch, one row a sample: column saccade (from 1), then `Trajectory.columns`.

    Raises:
        InputError: it cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    count, samples = len(trajectory), len(trajectory.time)
    columns = {"saccade": np.repeat(np.arange(1, count + 1), samples)}
    table = pa.table(columns | {name: values.ravel() for name, values in trajectory.columns().items()})
    return write_atomically(path, lambda temporary: pq.write_table(table, temporary))


def read_columns(path: str | Path, content: bytes, choose: Callable[[tuple[str, ...]], Iterable[str]]) -> Table:
    """Some columns of a Parquet file with this content; a missing value is NaN. Lines are rows, from 1.

    Args:
        path: of the file, for messages.
        content: of the file.
        choose: from the names of all columns to those that are wanted.

    Raises:
        InputError: it is damaged or none, has too many rows, or a column holds no numbers.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        file = pq.ParquetFile(io.BytesIO(content))
        header, rows = tuple(file.schema_arrow.names), file.metadata.num_rows
        if not 0 < rows <= _MOST:
            raise InputError(f"{path} has {rows} rows; from 1 to {_MOST} are read")
        names = tuple(choose(header))
        if len(set(header)) != len(header):
            raise InputError(f"{path}: a column stands twice in the header {listed(header)}; name each once")
        read = file.read(columns=list(names))
    except (pa.ArrowException, OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise unreadable(path, error, _HINT) from error
    columns = {}
    for name in names:
        kind = read.schema.field(name).type
        if not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
            raise InputError(f"{path}: column {name} holds {kind}, not numbers; convert it")
        columns[name] = np.asarray(read.column(name).cast(pa.float64(), safe=False).to_numpy(), float)
    return Table(Path(path), columns, tuple(range(1, rows + 1)))
