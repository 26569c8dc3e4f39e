"""What monitoring says of a fleet, ordered by the blocks of ISO 13374."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import xarray as xr

__all__ = ["fleet_report"]


def fleet_report(fleet: xr.Dataset) -> dict[str, Any]:
    """Return a fleet as plain numbers and words, for JSON; infinite times become null there.

    Parameters
    ----------
    fleet : xarray.Dataset
        From :func:`friction_bayes.monitor_fleet`.

    Returns
    -------
    dict
        The blocks that :meth:`friction_bayes.MonitorReport.to_dict` has for one machine, the machine whose
        remaining life is shortest first.
    """
    columns: Mapping[str, list[Any]] = {
        str(name): variable.values.tolist()
        for name, variable in fleet.data_vars.items()
        if variable.dims[0] == "machine"
    }
    machines = [str(name) for name in fleet["machine"].values.tolist()]
    statuses = fleet["status"].attrs["flag_meanings"].split()
    life = columns.get("remaining_life", [[math.inf] * 3] * len(machines))
    order = sorted(range(len(machines)), key=lambda k: (math.isnan(life[k][1]), life[k][1]))

    def prognosis(k: int) -> dict[str, Any]:
        low, middle, high = life[k]
        return {
            "machine": machines[k],
            "remaining_life": {"median": middle, "interval90": [low, high]},
            "probability_reached_already": columns["probability_above_threshold"][k],
            "probability_never_reached": columns["probability_never_reached"][k],
        }

    return {
        "data_acquisition": {
            "machines": len(machines),
            "detection_points": fleet.sizes["point"],
            "quantity": fleet.attrs["quantity"],
            "time_unit": fleet["detection_time"].attrs["units"],
        },
        "data_manipulation": {
            "method": "waveform",
            "records_not_usable": int((fleet["record_status"] != 0).sum()),
        },
        "state_detection": [
            {
                "machine": machines[k],
                "friction": _latest(columns["friction_mean"][k]),
                "discount": columns["discount"][k],
            }
            for k in order
        ],
        "health_assessment": {
            "threshold": fleet.attrs.get("threshold"),
            "unit": fleet["friction_mean"].attrs["units"],
            "machines": [
                {
                    "machine": machines[k],
                    "status": statuses[columns["status"][k]],
                    "points_used": columns["points_used"][k],
                    "friction": {"mean": columns["level_mean"][k], "sd": columns["level_sd"][k]},
                    "drift": {"mean": columns["drift_mean"][k], "sd": columns["drift_sd"][k]},
                }
                for k in order
            ],
        },
        "prognostic_assessment": [prognosis(k) for k in order] if "threshold" in fleet.attrs else None,
        "advisory_generation": {"most_urgent_first": [machines[k] for k in order]},
    }


def _latest(values: list[float]) -> float | None:
    """Return the value of the last point that has one."""
    return next((value for value in reversed(values) if not math.isnan(value)), None)
