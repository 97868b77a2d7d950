# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What a launch file of ROS 2 starts, by the interpreter of such files in the Python package play_launch.

usage: launch_file.py FILE [NAME:=VALUE...]   its arguments and its programs as JSON, or its error
"""
import ctypes
import importlib.util
import json
import pathlib
import sys

ABI = 7


def interpreter():
    package = pathlib.Path(importlib.util.find_spec("play_launch").origin).parent
    library = ctypes.CDLL(str(package / "lib/libplay_launch_parser_pyexec.so"))
    library.play_launch_py_exec.restype = ctypes.c_void_p
    library.play_launch_py_free.argtypes = [ctypes.c_void_p]
    if library.play_launch_py_abi_version() < ABI:
        raise ImportError("play_launch is too old")
    return library


def run(file, values):
    library = interpreter()
    include = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)(lambda *_: None)
    free = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda *_: None)
    request = json.dumps({"path": file, "state": {"configurations": values}}).encode()
    answer = ctypes.c_void_p(library.play_launch_py_exec(request, include, free, None))
    try:
        return json.loads(ctypes.string_at(answer.value))
    finally:
        library.play_launch_py_free(answer)


def main():
    said = run(sys.argv[1], dict(argument.split(":=", 1) for argument in sys.argv[2:]))
    if not said["ok"]:
        json.dump({"error": said["error"]}, sys.stdout)
        return
    produced = said["result"]["produced"]
    json.dump({"arguments": {one["name"]: one["description"] for one in produced["declared_arguments"]},
               "values": said["result"]["state"]["configurations"], "unsupported": produced["unsupported"],
               "programs": [{"package": node["package"], "command": [node["executable"], *node["arguments"]],
                             "remappings": dict(node["remappings"])} for node in produced["nodes"]]}, sys.stdout)


main()
