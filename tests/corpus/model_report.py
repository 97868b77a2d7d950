#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Measures slsd-model on rendered objects that turn, with Open3D, trimesh and MeshLab as readers.

A folder has object.ply (the true mesh, mm), pattern.toml, and for each frame 0000/, 0001/, ... with frame.png,
calibration.yml (no lens distortion), pose.txt (3x4, camera_from_object), depth.npy (mm along z, NaN where nothing is) and
mask.npy (1 where the projector's light falls). slsd scans the frames, slsd-model fuses the clouds."""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np
import open3d as o3d
import pymeshlab
import trimesh

CONFIGURATION = """
[pattern]
file = "{pattern}"
[projector]
driver = "headless"
[[camera]]
name = "camera"
driver = "file"
path = "frames"
[calibration]
file = "calibration.yml"
[decode]
density = "pixels"
precision = "fine"
depth_min_mm = {near}
depth_max_mm = {far}
[server]
socket = "slsd.sock"
"""
SAMPLES = 300_000
WRONG_PLACE_MM = 1.0
WALL_MM = 3.0
OBLIQUE_DEGREES = 75
BAND_VOXELS = 5.0  # as slsd-model has it
LARGE_MM, LARGE_VOXEL_MM = 300.0, 0.5
PROPERTIES = {"float": "<f4", "uchar": "u1", "ushort": "<u2"}


class Turning:
    """A rendered sequence."""

    def __init__(self, folder):
        self.folder = folder
        self.frames = sorted(path.parent for path in folder.glob("[0-9]*/pose.txt"))
        self.poses = [np.loadtxt(frame / "pose.txt") for frame in self.frames]
        self.calibration = self.frames[0] / "calibration.yml"
        text = self.calibration.read_text(encoding="utf-8")
        number = r"camera_matrix.*?data: \[([^]]*)\]"
        self.matrix = np.array(re.search(number, text, re.S).group(1).split(","), float).reshape(3, 3)
        self.object = o3d.io.read_triangle_mesh(str(folder / "object.ply"))

    def truth(self):
        """The true mesh in the rig's frame at the first cloud."""
        return o3d.geometry.TriangleMesh(self.object).transform(np.vstack([self.poses[0], [0, 0, 0, 1]]))

    def pixels(self, in_camera, shape):
        u, v = np.rint(in_camera[:, :2] / in_camera[:, 2:] @ self.matrix[:2, :2].T + self.matrix[:2, 2]).astype(int).T
        return np.clip(v, 0, shape[0] - 1), np.clip(u, 0, shape[1] - 1)

    def sights_of(self, places, normals):
        """In how many frames camera and projector both see these places of the object, and the least angle between the
        normal and the camera's ray, degrees."""
        seen, least = np.zeros(len(places), int), np.full(len(places), 180.0)
        for frame, pose in zip(self.frames, self.poses):
            in_camera = places @ pose[:, :3].T + pose[:, 3]
            depth, lit = np.load(frame / "depth.npy"), np.load(frame / "mask.npy")
            at = self.pixels(in_camera, depth.shape)
            sees = (abs(depth[at] - in_camera[:, 2]) < 1e-3 * in_camera[:, 2]) & (lit[at] > 0)
            cosines = -(normals @ pose[:, :3].T * in_camera).sum(1) / np.linalg.norm(in_camera, axis=1)
            seen += sees
            least = np.where(sees, np.minimum(least, np.degrees(np.arccos(np.clip(cosines, -1, 1)))), least)
        return seen, least


def processor_s(process):
    """Waits for a process. @return its status, processor time and peak memory in MiB

    The kernel's ru_maxrss would be that of this program, which is larger, as the process began as a copy of it.
    """
    peak_kib = 0
    while True:
        about = pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8")
        peak_kib = max([peak_kib, *map(int, re.findall(r"^VmHWM:\s+(\d+) kB", about, re.M))])
        ended, status, usage = os.wait4(process.pid, os.WNOHANG)
        if ended:
            break
        time.sleep(0.02)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime, peak_kib / 1024


def record(turning, folder, programs):
    """Scans the frames. @return the recording, and the service's processor time in seconds"""
    (folder / "frames").mkdir()
    for i, frame in enumerate(turning.frames):
        shutil.copy(frame / "frame.png", folder / f"frames/{i:04d}.png")
    shutil.copy(turning.calibration, folder)
    depth = np.load(turning.frames[0] / "depth.npy")
    near, far = 0.75 * np.nanmin(depth), 1.25 * np.nanmax(depth)
    (folder / "slsd.toml").write_text(CONFIGURATION.format(
        pattern=(turning.folder / "pattern.toml").resolve(), near=near, far=far), encoding="utf-8")
    slsctl = [programs / "slsctl", "--socket", folder / "slsd.sock"]
    with open(folder / "log", "wb") as log:
        service = subprocess.Popen([programs / "slsd", "--config", folder / "slsd.toml"], stderr=log)
    try:
        while service.poll() is None and not (folder / "slsd.sock").exists():
            time.sleep(0.05)
        subprocess.run([*slsctl, "record", folder / "recording", "--clouds", "--frames", str(len(turning.frames)),
                        "--timeout-ms", "600000"], check=True, stdout=subprocess.DEVNULL)
    finally:
        service.terminate()
    return folder / "recording", processor_s(service)[1]


def fuse(recording, mesh, programs, *options):
    """@return the report of slsd-model, its processor time in seconds and its peak memory in MiB"""
    with open(mesh.with_suffix(".json"), "wb") as report:
        process = subprocess.Popen([programs / "slsd-model", "--from", recording, "-o", mesh, "--json", *options],
                                   stdout=report)
    status, seconds, memory_mib = processor_s(process)
    if status != 0:
        sys.exit(f"slsd-model failed on {recording}")
    return json.loads(mesh.with_suffix(".json").read_text(encoding="utf-8")), seconds, memory_mib


def read_cloud(path):
    head, body = path.read_bytes().split(b"end_header\n", 1)
    lines = [line.split() for line in head.decode().split("\n")]
    fields = np.dtype([(line[2], PROPERTIES[line[1]]) for line in lines if line and line[0] == "property"])
    count = next(int(line[2]) for line in lines if line[:2] == ["element", "vertex"])
    return head, np.frombuffer(body, fields, count).copy()


def scene_of(mesh):
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    return scene


def tensor(values):
    return o3d.core.Tensor(np.asarray(values, np.float32))


def laid_on(mesh, truth):
    """The move onto the truth: the first cloud's place, in whose frame the mesh is, has an error of its own."""
    method = o3d.pipelines.registration
    found = method.registration_icp(
        mesh.sample_points_uniformly(SAMPLES // 2), truth.sample_points_uniformly(2 * SAMPLES, use_triangle_normal=True),
        3.0, np.eye(4), method.TransformationEstimationPointToPlane(), method.ICPConvergenceCriteria(1e-9, 1e-9, 60))
    return found.transformation


def walls(mesh, points, normals):
    """Share of the points that have a second surface, turned alike, within WALL_MM."""
    scene, double = scene_of(mesh), np.zeros(len(points), bool)
    for side in (1, -1):
        hit = scene.cast_rays(tensor(np.hstack([points + side * 0.05 * normals, side * normals])))
        alike = (hit["primitive_normals"].numpy() * normals).sum(1) > 0.3
        double |= (hit["t_hit"].numpy() < WALL_MM - 0.05) & alike
    return double.mean()


def score(turning, mesh):
    """Distances of a mesh from the truth, once it is laid on it."""
    truth = turning.truth()
    mesh.transform(laid_on(mesh, truth))
    cloud = mesh.sample_points_uniformly(SAMPLES, use_triangle_normal=True)
    points, normals = np.asarray(cloud.points), np.asarray(cloud.normals)
    off = scene_of(truth).compute_signed_distance(tensor(points)).numpy()
    sampled = turning.object.sample_points_uniformly(SAMPLES // 3, use_triangle_normal=True)
    places = np.asarray(sampled.points)
    seen, least = turning.sights_of(places, np.asarray(sampled.normals))
    first = turning.poses[0]
    in_rig = places @ first[:, :3].T + first[:, 3]
    near = scene_of(mesh).compute_distance(tensor(in_rig)).numpy() < 5e-4 * in_rig[:, 2].mean()
    return {"RMS, mm": np.sqrt((off ** 2).mean()), "95 %, mm": np.quantile(abs(off), 0.95), "mean outward, mm": off.mean(),
            "double walls, % of area": 100 * walls(mesh, points, normals),
            "of the visible surface, %": 100 * near[seen > 0].mean(),
            "of what three clouds see, %": 100 * near[seen > 2].mean(),
            f"of what one sees at up to {OBLIQUE_DEGREES} degrees, %": 100 * near[least <= OBLIQUE_DEGREES].mean()}


def places_off(turning, report):
    """How far each fused cloud's place is off, RMS over the object's surface, mm, after the one motion that suits all best.
    The mesh's own fit to the truth would not do: thin plates slide in it."""
    vertices = np.asarray(turning.object.vertices)
    at = vertices[::max(1, len(vertices) // 1000)]
    first = turning.poses[0]
    true, places = at @ first[:, :3].T + first[:, 3], []
    for fused in report["fused"]:
        pose = turning.poses[int(pathlib.Path(fused["frame"]).stem)]
        places.append((at @ pose[:, :3].T + pose[:, 3]) @ np.reshape(fused["rotation"], (3, 3)).T + fused["translation_mm"])
    middle, true_middle = np.mean(places, (0, 1)), true.mean(0)
    # Kabsch 1976.
    u, _, vt = np.linalg.svd(np.einsum("fpi,pj->ij", places - middle, true - true_middle))
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    return np.array([np.sqrt((((placed - middle) @ rotation + true_middle - true) ** 2).sum(1).mean()) for placed in places])


def defects(path):
    """What foreign readers find wrong with a mesh."""
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    meshes.compute_selection_by_self_intersections_per_face()
    of_trimesh, of_open3d = trimesh.load(path, process=False), o3d.io.read_triangle_mesh(str(path))
    return {"self-intersecting triangles (MeshLab)": meshes.current_mesh().selected_face_number(),
            "of triangles": len(of_trimesh.faces), "consistent winding (trimesh)": of_trimesh.is_winding_consistent,
            "manifold (Open3D)": of_open3d.is_edge_manifold(True) and of_open3d.is_vertex_manifold()}


def open3d_model(turning, recording, voxel_mm):
    """Open3D's multiway registration by its ICP, and its TSDF volume, of the same clouds."""
    method, clouds, images = o3d.pipelines.registration, [], []
    shape = np.load(turning.frames[0] / "depth.npy").shape
    for path in sorted((recording / "clouds").glob("*.ply")):
        points = read_cloud(path)[1]
        xyz = np.stack([points[axis] for axis in "xyz"], 1).astype(float)
        image = np.zeros(shape, np.float32)
        image[turning.pixels(xyz, shape)] = xyz[:, 2]
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(xyz)).voxel_down_sample(2 * voxel_mm)
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(8 * voxel_mm, 30))
        cloud.orient_normals_towards_camera_location()
        images.append(image), clouds.append(cloud)

    def icp(a, b, start):
        for reach in (40, 12, 4):
            start = method.registration_icp(clouds[a], clouds[b], reach * voxel_mm, start,
                                            method.TransformationEstimationPointToPlane()).transformation
        return start, method.get_information_matrix_from_point_clouds(clouds[a], clouds[b], 4 * voxel_mm, start)

    graph, place = method.PoseGraph(), np.eye(4)
    graph.nodes.append(method.PoseGraphNode(place))
    for i in range(1, len(clouds)):
        middle = clouds[i].get_center(), clouds[i - 1].get_center()
        start = np.eye(4)
        start[:3, 3] = middle[1] - middle[0]
        step, information = icp(i, i - 1, start)
        place = place @ step
        graph.nodes.append(method.PoseGraphNode(place))
        graph.edges.append(method.PoseGraphEdge(i, i - 1, step, information, uncertain=False))
    last = len(clouds) - 1
    step, information = icp(last, 0, place)
    graph.edges.append(method.PoseGraphEdge(last, 0, step, information, uncertain=True))
    method.global_optimization(graph, method.GlobalOptimizationLevenbergMarquardt(),
                               method.GlobalOptimizationConvergenceCriteria(),
                               method.GlobalOptimizationOption(4 * voxel_mm, 0.25, 1.0, 0))
    number, device = o3d.core.float32, o3d.core.Device("CPU:0")
    volume = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight"), (number, number), ((1), (1)), 1e-3 * voxel_mm, 16, 20_000,
                                           device)
    lens = o3d.core.Tensor(turning.matrix)
    for image, node in zip(images, graph.nodes):
        place = np.linalg.inv(node.pose)
        place[:3, 3] *= 1e-3
        seen = o3d.t.geometry.Image(o3d.core.Tensor(image)), lens, o3d.core.Tensor(place), 1e3, 1e3, BAND_VOXELS
        volume.integrate(volume.compute_unique_block_coordinates(*seen), *seen)
    return volume.extract_triangle_mesh(weight_threshold=1.5).to_legacy().scale(1e3, np.zeros(3))


def enlarge(recording, to, factor):
    """The recording of an object that is larger and farther by the same factor: on the same rays."""
    shutil.copytree(recording, to, ignore=shutil.ignore_patterns("camera"))
    for path in (to / "clouds").glob("*.ply"):
        head, points = read_cloud(path)
        for field in ("x", "y", "z", "sigma_mm"):
            points[field] *= factor
        path.write_bytes(head + b"end_header\n" + points.tobytes())
    return to


def show(title, figures):
    print(title)
    for name, value in figures.items():
        print(f"  {name:40s} {value:.3f}" if isinstance(value, (float, np.floating)) else f"  {name:40s} {value}", flush=True)


def measure(turning, programs, keep):
    recording, scanning_s = record(turning, keep, programs)
    report, seconds, memory_mib = fuse(recording, keep / "model.ply", programs)
    figures = score(turning, o3d.io.read_triangle_mesh(str(keep / "model.ply")))
    off, frames = places_off(turning, report), len(turning.frames)
    show(f"{turning.folder.name}: {len(off)} of {frames} clouds fused, voxels of {report['voxel_mm']:.2f} mm", figures)
    show("places", {"drift before closing, mm": report.get("drift_mm", "not closed"),
                    "seam after, mm": report.get("seam_mm", "not closed"), "place off, RMS, mm": np.sqrt((off ** 2).mean()),
                    f"fused with a place off by {WRONG_PLACE_MM} mm": int((off > WRONG_PLACE_MM).sum())})
    show("cost, of one core", {"clouds a second, slsd-model": frames / seconds, "clouds a second, slsd": frames / scanning_s,
                               "peak memory of slsd-model, MiB": memory_mib})
    show("mesh", defects(keep / "model.ply"))
    of_open3d = score(turning, open3d_model(turning, recording, report["voxel_mm"]))
    show("Open3D's ICP and TSDF, same clouds", of_open3d)
    size_mm = (turning.object.get_max_bound() - turning.object.get_min_bound()).max()
    large = enlarge(recording, keep / "large", LARGE_MM / size_mm)
    _, _, large_mib = fuse(large, keep / "large.ply", programs, "--voxel", str(LARGE_VOXEL_MM))
    show(f"as an object of {LARGE_MM:.0f} mm with voxels of {LARGE_VOXEL_MM} mm", {"peak memory, MiB": large_mib})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", metavar="FOLDER", nargs="+", type=pathlib.Path)
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("build/release/bin"))
    given = parser.parse_args()
    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    for folder in given.folders:
        with tempfile.TemporaryDirectory(prefix="slsd-report-") as temporary:
            measure(Turning(folder), given.programs.resolve(), pathlib.Path(temporary))


if __name__ == "__main__":
    main()
