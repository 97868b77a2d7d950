# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Setup for colcon, with ament_python: ament_cmake's slsdConfig.cmake would hide that of slsd's C++ library."""
from glob import glob
from xml.etree import ElementTree

from setuptools import setup

package = ElementTree.parse('package.xml').getroot()
setup(
    name='slsd',
    version=package.findtext('version'),
    description=package.findtext('description'),
    license=package.findtext('license'),
    packages=[],
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/slsd']),
        ('share/slsd', ['package.xml']),
        *((f'share/slsd/{folder}', glob(f'{folder}/*.*')) for folder in ('launch', 'rviz', 'urdf')),
    ],
)
