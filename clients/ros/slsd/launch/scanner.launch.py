# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Publishes a scanner of slsd in ROS 2: ros2 launch slsd scanner.launch.py.

slsd-dds publishes clouds, images, transforms and the robot description. It uses the service that answers at the socket.
If none does, this file starts one.
"""
import json
import os
import re
import shutil
import socket

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, LogInfo, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

USUAL_SOCKET = '/run/slsd/slsd.sock'
USUAL_BASE = 'base_link'
RVIZ_CONFIG = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), 'rviz', 'scanner.rviz')
RESPAWN_S = 2.0
WRONG_USAGE = (2, 78)  # exit codes of slsd and slsd-dds, if starting them again cannot help

# Name, default, description, and allowed values.
ARGUMENTS = (
    ('name', 'scanner', 'name of the scanner; its topics and frames begin with it'),
    ('socket', '', f'socket of the service; default: that of config, else SLSD_SOCKET, else {USUAL_SOCKET}'),
    ('start_service', 'auto', 'whether to start slsd; auto: if no service answers at the socket', ('auto', 'true', 'false')),
    ('config', '', 'configuration of a service that this starts; default: /etc/slsd/slsd.toml'),
    ('rate', '', 'at most this many clouds per second; 0: only triggered ones; default: every frame'),
    ('density', '', 'a point for each symbol, or for each camera pixel; default: as the service is configured',
     ('', 'symbols', 'pixels')),
    ('stride', '', 'use every Nth camera pixel and row in dense clouds; default: 2'),
    ('voxel', '', 'one point per cube of this size in mm; default: all points'),
    ('image_rate', '2', 'images per second of each camera, if somebody subscribes; 0: none'),
    ('extrinsics', '', 'file with the places of several scanners; default: NAME_link is its root'),
    ('flange', '', 'frame in tf of the flange that carries the scanner, such as tool0: puts clouds into robot_base'),
    ('robot_base', '', f'frame of clouds in the robot\'s base; default: {USUAL_BASE}'),
    ('transforms', 'true', 'false: your robot description places the scanner\'s frames', ('true', 'false')),
    ('rviz', 'false', 'whether to start RViz', ('true', 'false')),
)
OPTIONS = ('rate', 'density', 'stride', 'voxel', 'image_rate', 'extrinsics', 'flange', 'robot_base')


def program(name):
    path = shutil.which(name)
    if path is None:
        raise RuntimeError(f'{name} is not installed, or not in PATH: install the package {name} of slsd')
    return path


def socket_of(config):
    """The socket that a configuration names."""
    try:
        import tomllib
    except ImportError:  # Python 3.10 in Humble
        raise RuntimeError(f'also give the socket of {config}: socket:=PATH') from None
    with open(config, 'rb') as file:
        path = tomllib.load(file).get('server', {}).get('socket', USUAL_SOCKET)
    return os.path.join(os.path.dirname(os.path.abspath(config)), path)


def ask(path):
    """The state of the service at a socket; empty if it answers too slowly; None if no service listens."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(2)
        try:
            connection.connect(path)
        except (FileNotFoundError, ConnectionRefusedError):
            return None
        except PermissionError:
            raise RuntimeError(f'{path}: no permission: sudo adduser $USER slsd, and log in again') from None
        try:
            connection.sendall(b'{"jsonrpc": "2.0", "id": 1, "method": "status"}\n')
            return json.loads(connection.makefile().readline())['result']
        except (OSError, ValueError, KeyError):
            return {}


def lasting(command):
    """A program that restarts if it ends, unless its usage was wrong."""
    return ExecuteProcess(
        cmd=command, output='screen', respawn=True, respawn_delay=RESPAWN_S,
        on_exit=lambda event, _: [Shutdown(reason='wrong usage')] if event.returncode in WRONG_USAGE else None)


def service(wanted, config, path, state):
    if wanted == 'false' or (wanted == 'auto' and state is not None and not config):
        return []
    if state is not None:
        raise RuntimeError(f'{path}: a service answers here already: stop it, or leave out config and start_service')
    return [LogInfo(msg=f'no service answers at {path}: starting slsd (or start it yourself: sudo systemctl start slsd)'),
            lasting([program('slsd'), *(['--config', config] if config else [])])]


def rviz(name, frame, state):
    """RViz, with the names in its configuration mapped to this scanner's names."""
    cameras = (state or {}).get('cameras') or [{'name': 'camera'}]
    camera = re.sub('[^A-Za-z0-9_]', '_', cameras[0]['name'])
    camera = camera if camera[:1].isalpha() else 'camera_' + camera
    topics = {'points': 'points', 'robot_description': 'robot_description', 'camera/image_raw': f'{camera}/image_raw'}
    return Node(package='rviz2', executable='rviz2', arguments=['-d', RVIZ_CONFIG, '-f', frame],
                remappings=[(f'/scanner/{shown}', f'/{name}/{topic}') for shown, topic in topics.items()])


def start(context):
    given = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    config = os.path.expanduser(given['config'])
    path = given['socket'] or (socket_of(config) if config else os.environ.get('SLSD_SOCKET') or USUAL_SOCKET)
    state = ask(path)
    command = [program('slsd-dds'), '--name', given['name'], '--socket', path]
    for option in OPTIONS:
        if given[option]:
            command += ['--' + option.replace('_', '-'), given[option]]
    if given['transforms'] == 'false':
        command.append('--no-transforms')
    own = given['name'] + ('_optical_frame' if given['extrinsics'] else '_link')
    frame = (given['robot_base'] or USUAL_BASE) if given['flange'] else own
    return [*service(given['start_service'], config, path, state), lasting(command),
            *([rviz(given['name'], frame, state)] if given['rviz'] == 'true' else [])]


def generate_launch_description():
    declared = [DeclareLaunchArgument(name, default_value=default, description=description,
                                      **({'choices': list(choices[0])} if choices else {}))
                for name, default, description, *choices in ARGUMENTS]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
