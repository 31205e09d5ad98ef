"""Rows as a pandas DataFrame, where pandas is installed."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from lab.optional import optional

if TYPE_CHECKING:
    import pandas


def data_frame(rows: Iterable[Mapping[str, Any]]) -> "pandas.DataFrame":
    """Rows as a DataFrame. BadInput when pandas is not installed."""
    with optional("to_dataframe()"):
        from pandas import DataFrame
    return DataFrame.from_records([dict(row) for row in rows])
