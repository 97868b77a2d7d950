# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
import matplotlib.pyplot as plot
import slsd

axes = plot.figure().add_subplot()
for cloud in slsd.Scanner().stream(rate_hz=5):
    axes.cla()
    axes.scatter(cloud.points["x"], -cloud.points["y"], s=2, c=cloud.points["z"])
    plot.pause(0.01)
    if not plot.get_fignums():
        break
