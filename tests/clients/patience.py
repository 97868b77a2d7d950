# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Gives requests of the Python client the time that the service's configuration allows, instead of 5 s: a busy machine
may need it. Import it for this effect."""
import slsd

for _method in (slsd.Scanner.scan, slsd.Scanner.save, slsd.Scanner.frame, slsd.Scanner.preview, slsd.Scanner.project):
    _method.__kwdefaults__["timeout_s"] = None
