"""The commands of ``friction-bayes``, one module each: ``add_parser(commands)`` and ``run(arguments)``."""

from __future__ import annotations

import friction_bayes.cli.commands.app as app
import friction_bayes.cli.commands.close_loop as close_loop
import friction_bayes.cli.commands.completion as completion
import friction_bayes.cli.commands.datasets as datasets
import friction_bayes.cli.commands.demo as demo
import friction_bayes.cli.commands.estimate as estimate
import friction_bayes.cli.commands.monitor as monitor
import friction_bayes.cli.commands.simulate as simulate

__all__ = ["COMMANDS"]

COMMANDS = (demo, estimate, close_loop, monitor, simulate, datasets, app, completion)
