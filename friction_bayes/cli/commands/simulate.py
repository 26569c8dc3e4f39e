"""``friction-bayes simulate``: a synthetic record with friction and any effect of the catalogue."""

from __future__ import annotations

import argparse
import math
from typing import Any

import friction_bayes as fb
from friction_bayes.cli.console import compilation_noted, note
from friction_bayes.cli.extensions import add_register, register_extensions
from friction_bayes.cli.options import add_seed, add_system, key_values, system_of
from friction_bayes.core.checks import non_negative
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import check_file_target
from friction_bayes.core.system import Oscillator

__all__ = ["add_parser"]

_AMPLITUDE_IN_DEADBANDS = 100.0
"""Default release: 100 r/k, from where the motion takes 50 half cycles."""
_LARGEST_DEFAULT_ANGLE = 1.0
_EPILOG = """example:
  friction-bayes simulate --mass 10 --stiffness 1000 --friction 0.07 --initial-displacement 0.0147 \\
      --noise-sd 5e-4 --effect viscous_damping.damping_ratio=0.001 --out decay.csv
"""


def add_parser(commands: Any) -> None:
    """Add ``simulate SYSTEM --friction F --out FILE``."""
    parser = commands.add_parser(
        "simulate",
        help="write a synthetic record",
        description="Simulate a free decay and write it as CSV or NetCDF, marked as synthetic.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add_system(parser)
    motion = parser.add_argument_group("motion")
    motion.add_argument(
        "--friction", type=float, required=True, metavar="F", help="friction force [N or N m]"
    )
    motion.add_argument(
        "--effect",
        nargs="+",
        action="extend",
        metavar="NAME.PARAMETER=VALUE",
        help="effects of the catalogue, such as viscous_damping.damping_ratio=0.01",
    )
    add_register(motion)
    motion.add_argument(
        "--initial-displacement",
        type=float,
        metavar="M",
        help="at release (default: 100 friction / stiffness)",
    )
    motion.add_argument("--initial-velocity", type=float, default=0.0, metavar="M_PER_S", help="(default: 0)")
    motion.add_argument(
        "--duration", type=float, metavar="S", help="(default: until rest under friction alone)"
    )
    sensor = parser.add_argument_group("sensor")
    sensor.add_argument("--quantity", metavar="NAME", help="(default: displacement, or angle)")
    sensor.add_argument("--sampling-rate", type=float, default=1000.0, metavar="HZ", help="(default: 1000)")
    sensor.add_argument(
        "--noise-sd", type=float, default=0.0, metavar="SD", help="unit of the signal (default: 0)"
    )
    sensor.add_argument("--sensor-range", type=float, metavar="R", help="saturates at -R and R")
    sensor.add_argument("--bits", type=int, metavar="N", help="resolution over the sensor range")
    add_seed(parser)
    parser.add_argument("--out", required=True, metavar="FILE", help="a .csv or .nc file")
    parser.add_argument("--force", action="store_true", help="overwrite the file")
    parser.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> None:
    """Simulate and write one record."""
    target = check_file_target(arguments.out, force=arguments.force)
    register_extensions(arguments.register)
    system = system_of(arguments)
    non_negative("--friction", arguments.friction)
    release = _release(arguments, system)
    with compilation_noted():
        record = fb.simulate(
            system,
            friction=arguments.friction,
            initial_displacement=release,
            initial_velocity=arguments.initial_velocity,
            duration=_duration(arguments, system, release),
            sampling_rate=arguments.sampling_rate,
            noise_sd=arguments.noise_sd,
            quantity=arguments.quantity,
            sensor_range=arguments.sensor_range,
            bits=arguments.bits,
            effects=key_values(arguments.effect, "--effect"),
            seed=arguments.seed,
            name=target.name,
        )
    if record.attrs.get("stop_time") == 0.0:
        raise InputError(
            "--friction",
            f"{arguments.friction:g} {system.friction_unit} holds what is released at {release:g} "
            f"{system.length_unit}: it never moves",
            "give less friction or a larger --initial-displacement",
        )
    fb.write_record(record, target)
    note(f"{target}: {record.size} samples of synthetic {record.attrs['quantity']} [{record.attrs['units']}]")


def _release(arguments: argparse.Namespace, system: Oscillator) -> float:
    if arguments.initial_displacement is not None:
        return float(arguments.initial_displacement)
    if not arguments.friction > 0.0:
        raise InputError("--initial-displacement", "has no default without friction", "give it")
    release = _AMPLITUDE_IN_DEADBANDS * arguments.friction / system.stiffness
    return min(release, _LARGEST_DEFAULT_ANGLE) if system.angular else release


def _duration(arguments: argparse.Namespace, system: Oscillator, release: float) -> float:
    """Return the duration asked for, or five periods more than Coulomb friction needs to stop the motion."""
    if arguments.duration is not None:
        return float(arguments.duration)
    if not arguments.friction > 0.0:
        raise InputError("--duration", "has no default without friction", "give it")
    energetic = math.hypot(release, arguments.initial_velocity / system.natural_frequency)
    half_cycles = energetic * system.stiffness / (2.0 * arguments.friction)
    return (half_cycles + 10.0) * math.pi / system.natural_frequency
