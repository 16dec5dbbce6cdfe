"""What rays other than primary ones cost, of the full pipeline's results."""

from .results import earlier_results

__all__ = ["secondary_rows"]

_FIELDS = "demo", "size", "rays", "rays_by_kind", "cycles_per_ray", "busy", "rtl_wrong_pixels"


def secondary_rows(folder):
    """Rows of the demos in pipeline.json: lights and shadows, 200 lights, mirrors, glass; [] if there are none.

    Parameters
    ----------
    folder : Path
        Of results.

    Raises
    ------
    BadInput
        If pipeline.json is not JSON.
    """
    return [{field: row[field] for field in _FIELDS if field in row}
            for row in earlier_results(folder / "pipeline.json").get("demos", [])]
