# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Any recorded frame will do: slsd --config tests/clients/recorded/gap/slsd.toml, with SLSD_SOCKET=/tmp/slsd-example.sock
import sys
try:
    import matplotlib.pyplot as plot
    import slsd
    clouds = slsd.Scanner().stream(rate_hz=5)
except Exception as error:
    sys.exit(f"usage: live_view.py (needs matplotlib and a scanner)\nlive_view.py: {error}")
axes = plot.figure().add_subplot()
for cloud in clouds:
    axes.cla()
    axes.scatter(cloud.points["x"], -cloud.points["y"], s=2, c=cloud.points["z"])
    plot.pause(0.01)
    if not plot.get_fignums():
        break
