"""What every command begins with, and what takes longer than most of them: imported once, then forked."""

import jinja2  # noqa: F401 - a report needs it
import matplotlib.figure  # noqa: F401 - the same

from conformance import resources
from conformance.catalogue import load_checks
from conformance.spec.load import load_spec

load_checks()
for name in resources.names("device_specs"):
    load_spec(resources.find("device_specs", name, "DEVICE"))
