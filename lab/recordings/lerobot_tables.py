"""The Parquet files of a LeRobot dataset: numbers, texts and pictures' bytes by row, read within bounds, and written."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, WorkFailed, shortened, unknown
from lab.files import is_file
from lab.lazy import pyarrow
from lab.optional import require
from lab.recordings.lerobot_info import NUMBERS, Feature

MOST_BYTES = 4 << 30  # of what is unpacked at once
MOST_TEXT_BYTES = 100_000_000
MOST_WHOLE = 2**53  # up to which a float holds each whole number
BATCH = 16  # pictures that are unpacked at once

Columns = Mapping[str, NDArray[np.generic]]


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """A block that reads a file; raises BadInput, which names it, if it is missing or damaged."""
    try:
        yield
    except (pyarrow.lib.ArrowException, OSError, ValueError, KeyError, ArithmeticError) as error:
        if not is_file(path):
            raise BadInput(f"'{shortened(path, 200)}': no such file") from None
        raise BadInput(f"'{path}': no readable Parquet file: {shortened(error)}") from None


class ParquetTable:
    """A Parquet file, of which columns are read by rows. Each method raises BadInput for a damaged file."""

    def __init__(self, path: Path) -> None:
        """Reads the file's description."""
        require(f"'{path}'", pyarrow, extra="recordings")
        self.path = path
        with _readable(path):
            self._file: Any = pyarrow.parquet.ParquetFile(path)
            self.rows: int = self._file.metadata.num_rows
            self.names: tuple[str, ...] = tuple(self._file.schema_arrow.names)
            about = self._file.metadata
            self._ends = np.cumsum([about.row_group(group).num_rows for group in range(about.num_row_groups)])

    def _groups(self, name: str, first: int, after: int, most_bytes: int, width: int | None) -> tuple[list[int], int]:
        """The row groups with rows `first` to `after` of a column, and their first row; checked before they are unpacked."""
        if name not in self.names:
            raise unknown("column", name, self.names, f"'{self.path}'")
        if not 0 <= first <= after <= self.rows:
            raise BadInput(f"'{self.path}': rows {first} to {after} of a file with {self.rows}")
        groups = [g for g, end in enumerate(self._ends) if end > first and (self._ends[g - 1] if g else 0) < after]
        total = 0
        for group in groups:
            about = self._file.metadata.row_group(group)
            for column in map(about.column, range(about.num_columns)):
                if column.path_in_schema == name or column.path_in_schema.startswith(f"{name}."):
                    total += column.total_uncompressed_size
                    if width is not None and column.num_values > width * about.num_rows:
                        raise BadInput(f"'{self.path}': column '{name}': more than {width} numbers in a row")
        if total > most_bytes:
            raise BadInput(f"'{self.path}': column '{name}' unpacks to {total} bytes, allowed are {most_bytes}")
        return groups, int(self._ends[groups[0] - 1]) if groups and groups[0] else 0

    def _column(self, name: str, first: int, after: int, most_bytes: int, width: int | None = None) -> Any:
        groups, start = self._groups(name, first, after, most_bytes, width)
        read = self._file.read_row_groups(groups, columns=[name], use_threads=False).column(name)
        return pyarrow.concat_arrays(read.slice(first - start, after - first).chunks) if read.num_chunks else None

    def numbers(self, name: str, shape: tuple[int, ...], first: int = 0, after: int | None = None) -> NDArray[Any]:
        """The numbers (n, *shape) of a column in rows `first` to `after`. BadInput if there are others, or too few."""
        after = self.rows if after is None else after
        where, types = f"'{self.path}': column '{name}'", pyarrow.types
        with _readable(self.path):
            width = int(np.prod(shape))
            array = self._column(name, first, after, MOST_BYTES, width)
            if array is None or not len(array):
                return np.zeros((0, *shape), np.float32)
            for edge in shape:
                kind = array.type
                if not (types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind)):
                    break
                if array.null_count or not np.all(array.value_lengths().to_numpy(zero_copy_only=False) == edge):
                    raise BadInput(f"{where}: wanted {' x '.join(map(str, shape))} numbers in each row")
                array = array.flatten()
            if array.null_count or not (types.is_primitive(array.type) or types.is_boolean(array.type)):
                raise BadInput(f"{where}: wanted numbers, and none missing")
            values: NDArray[Any] = array.to_numpy(zero_copy_only=False)
            if values.dtype.kind not in "biuf" or values.size != (after - first) * width:
                raise BadInput(f"{where}: wanted {' x '.join(map(str, shape))} numbers in each row")
        return values.reshape(after - first, *shape)

    def whole_numbers(self, name: str) -> NDArray[np.int64]:
        """The whole numbers (n,) of a column."""
        return whole_numbers(self.numbers(name, (1,))[:, 0], f"'{self.path}': column '{name}'")

    def texts(self, name: str) -> list[str]:
        """The texts of a column."""
        with _readable(self.path):
            texts = self._column(name, 0, self.rows, MOST_TEXT_BYTES)
            rows = [] if texts is None else texts.to_pylist()
        if not all(isinstance(row, str) for row in rows):
            raise BadInput(f"'{self.path}': column '{name}': wanted texts")
        return rows

    def pictures(self, name: str, first: int, after: int) -> Iterator[bytes]:
        """The bytes of the encoded pictures in rows `first` to `after`, a few of which are unpacked at once."""
        with _readable(self.path):
            groups, row = self._groups(name, first, after, MOST_BYTES, None)
            kind = self._file.schema_arrow.field(name).type
            if not pyarrow.types.is_struct(kind) or kind.get_field_index("bytes") < 0:
                raise BadInput(f"'{self.path}': column '{name}': wanted encoded pictures")
            for batch in self._file.iter_batches(BATCH, groups, columns=[name], use_threads=False):
                for content in batch.column(0).field("bytes"):
                    if first <= row < after:
                        picture = content.as_py()
                        if not isinstance(picture, bytes):
                            raise BadInput(f"'{self.path}': column '{name}', row {row}: no picture in the file")
                        yield picture
                    row += 1
                    if row == after:
                        return


def whole_numbers(values: NDArray[Any], where: str) -> NDArray[np.int64]:
    """The values as whole numbers. BadInput, which begins with `where`, if one is none, or too large."""
    if not (np.abs(values.astype(np.float64)) <= MOST_WHOLE).all() or (values != np.floor(values)).any():
        raise BadInput(f"{where}: wanted whole numbers")
    return values.astype(np.int64)


def task_texts(path: Path) -> dict[int, str]:
    """The texts of a dataset's tasks, by number."""
    table = ParquetTable(path)
    column = next((name for name in ("task", "__index_level_0__") if name in table.names), "task")
    return dict(zip(table.whole_numbers("task_index").tolist(), table.texts(column), strict=True))


# ---- written -------------------------------------------------------------------------------------------------------------


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except (pyarrow.lib.ArrowException, OSError) as error:
        raise WorkFailed(f"'{path}' cannot be written: {shortened(error)}") from None


def _typed(feature: Feature) -> Any:
    """The Arrow type of a feature's column: a number, a list of fixed length, or lists in lists."""
    kind = pyarrow.bool_() if feature.dtype == "bool" else pyarrow.from_numpy_dtype(np.dtype(feature.dtype))
    if len(feature.shape) == 1:
        return kind if feature.shape == (1,) else pyarrow.list_(kind, feature.shape[0])
    for _ in feature.shape:
        kind = pyarrow.list_(kind)
    return kind


def _column(values: NDArray[np.generic], kind: Any) -> Any:
    array = pyarrow.array(np.ascontiguousarray(values).reshape(-1))
    for edge in reversed(values.shape[1:]):
        array = pyarrow.FixedSizeListArray.from_arrays(array, edge)
    return array.cast(kind)


class NumbersWriter:
    """A Parquet file of numbers by feature, with a row group for each episode."""

    def __init__(self, path: Path, features: Mapping[str, Feature]) -> None:
        """Creates the file; features that are no numbers are left out. Raises WorkFailed if it cannot be written."""
        require(f"'{path}'", pyarrow, extra="recordings")
        self.path, self.rows = path, 0
        kinds = {name: _typed(feature) for name, feature in features.items() if feature.dtype in NUMBERS}
        self._schema = pyarrow.schema(kinds.items())
        with _writing(path):
            self._writer: Any = pyarrow.parquet.ParquetWriter(path, self._schema, compression="snappy")

    def add(self, columns: Columns) -> None:
        """Appends rows: by feature, an array (n, ...), in which a feature of shape (1,) is (n,)."""
        with _writing(self.path):
            arrays = [_column(columns[field.name], field.type) for field in self._schema]
            self._writer.write_table(pyarrow.Table.from_arrays(arrays, schema=self._schema))
        self.rows += len(columns["index"])

    @property
    def bytes(self) -> int:
        """The size of what is in the file so far."""
        return self.path.stat().st_size

    def close(self) -> None:
        """Finishes the file."""
        with _writing(self.path):
            self._writer.close()


class RowsWriter:
    """A Parquet file of rows with the same keys, such as those of the episodes; the first rows decide the types."""

    def __init__(self, path: Path) -> None:
        """Nothing is written before the first rows."""
        self.path = path
        self._writer: Any = None
        self._schema: Any = None

    def add(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Appends rows. Raises WorkFailed if the file cannot be written."""
        with _writing(self.path):
            table = pyarrow.Table.from_pylist(rows, schema=self._schema)
            if self._writer is None:
                self._schema = table.schema
                self._writer = pyarrow.parquet.ParquetWriter(self.path, table.schema, compression="snappy")
            self._writer.write_table(table)

    def close(self) -> None:
        """Finishes the file."""
        if self._writer is not None:
            with _writing(self.path):
                self._writer.close()


def write_tasks(path: Path, texts: Sequence[str]) -> None:
    """Writes the tasks' texts with their numbers, as a table whose index pandas takes to be the texts."""
    table = pyarrow.table({"task_index": pyarrow.array(range(len(texts)), pyarrow.int64()), "task": list(texts)})
    kinds = {"task_index": ("int64", "int64"), "task": ("unicode", "object")}
    columns = [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": held, "metadata": None}
        for name, (kind, held) in kinds.items()
    ]
    about = {"index_columns": ["task"], "column_indexes": [], "columns": columns, "pandas_version": "2.2.0"}
    with _writing(path):
        pyarrow.parquet.write_table(table.replace_schema_metadata({"pandas": json.dumps(about)}), path)
