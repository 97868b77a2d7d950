# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Saves a scan as a point cloud with Open3D (pip install open3d), without isolated points.

Any recorded frame will do: slsd --config tests/clients/recorded/gap/slsd.toml, with SLSD_SOCKET=/tmp/slsd-example.sock
"""
import argparse

import slsd


def main(file):
    import open3d
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(slsd.Scanner().scan().xyz.astype(float)))
    cloud, _ = cloud.remove_statistical_outlier(nb_neighbors=16, std_ratio=3)
    open3d.io.write_point_cloud(file, cloud)
    print(len(cloud.points), "points")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", metavar="FILE.ply")
    options = parser.parse_args()
    try:
        main(options.file)
    except (slsd.ScannerError, ImportError) as error:
        parser.error(str(error))
