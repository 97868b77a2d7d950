# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Reads scanner "left" by Eclipse's own Python binding, with ROS's message definitions: dds_reader.py DOMAIN. Prints JSON."""
import json
import sys
import time
from dataclasses import asdict, dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class PointField(IdlStruct, typename="sensor_msgs::msg::dds_::PointField_"):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2(IdlStruct, typename="sensor_msgs::msg::dds_::PointCloud2_"):
    header: Header
    height: uint32
    width: uint32
    fields: sequence[PointField]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class Empty(IdlStruct, typename="std_msgs::msg::dds_::Empty_"):
    structure_needs_at_least_one_member: uint8


# Behind the header of rmw_cyclonedds: who asks, and which of its requests it is.
@dataclass
class TriggerRequest(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Request_"):
    client_guid: uint64
    sequence_number: int64
    structure_needs_at_least_one_member: uint8


@dataclass
class TriggerResponse(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Response_"):
    client_guid: uint64
    sequence_number: int64
    success: bool
    message: str


NETWORK = """<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>120</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""


def main(number):
    domain = Domain(number, NETWORK)
    participant = DomainParticipant(number)
    sensor = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5))
    service = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
    latched = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal)

    def one(topic, kind, qos):
        reader = DataReader(participant, Topic(participant, topic, kind), qos=qos)
        for sample in reader.take_iter(timeout=duration(seconds=600)):
            return asdict(sample)
        raise TimeoutError(topic)

    def trigger(replies):
        """The trigger service, as a node of ROS calls it; and the topic, by which a cloud comes too."""
        requests = DataWriter(participant, Topic(participant, "rq/left/triggerRequest", TriggerRequest), qos=service)
        topic = DataWriter(participant, Topic(participant, "rt/left/trigger", Empty), qos=service)
        time.sleep(2)  # until they found each other
        requests.write(TriggerRequest(0x1122334455667788, 7, 0))
        answer = next(replies.take_iter(timeout=duration(seconds=600)))
        topic.write(Empty(0))
        time.sleep(1)
        return asdict(answer)

    replies = DataReader(participant, Topic(participant, "rr/left/triggerReply", TriggerResponse), qos=service)
    image = one("rt/left/camera/image_raw", Image, sensor)
    image["data"] = bytes(image["data"]).hex()
    cloud = one("rt/left/points", PointCloud2, sensor)
    cloud["data"] = bytes(cloud["data"]).hex()
    print(json.dumps({"points": cloud, "info": one("rt/left/camera/camera_info", CameraInfo, sensor),
                      "transforms": one("rt/tf_static", TFMessage, latched), "image": image,
                      "diagnostics": one("rt/diagnostics", DiagnosticArray, service), "trigger": trigger(replies)}))
    del domain


main(int(sys.argv[1]))
