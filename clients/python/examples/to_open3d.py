# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""One scan as a point cloud of Open3D, cleaned of what stands alone: to_open3d.py FILE.ply"""
import sys

import open3d

import slsd

cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(slsd.Scanner().scan().xyz.astype(float)))
cloud, _ = cloud.remove_statistical_outlier(nb_neighbors=16, std_ratio=3)
open3d.io.write_point_cloud(sys.argv[1], cloud)
print(len(cloud.points), "points")
