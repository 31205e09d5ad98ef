"""Rows as a pandas DataFrame, where pandas is installed."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput

if TYPE_CHECKING:
    import pandas


def data_frame(rows: Iterable[Mapping[str, Any]]) -> "pandas.DataFrame":
    """Rows as a DataFrame. BadInput when pandas is not installed."""
    try:
        from pandas import DataFrame
    except ImportError:
        raise BadInput(
            "to_dataframe(): pandas is not installed: pip install pandas, or take the rows themselves"
        ) from None
    return DataFrame.from_records([dict(row) for row in rows])
