"""Detection points T1..Tn followed to a threshold: Fig. 1 of the paper."""

from __future__ import annotations

from friction_bayes.monitor.fleet import monitor_fleet
from friction_bayes.monitor.records import monitor_records
from friction_bayes.monitor.report import MonitorReport

__all__ = ["MonitorReport", "monitor_fleet", "monitor_records"]
