#!/usr/bin/env python3
"""Checks the messages that viewers know by name against Foxglove's own schemas (PyPI: foxglove-schemas-protobuf).

    ci/check_foxglove.py LOG.mcap [--expect /tool /log /scene]

For every topic whose message is a foxglove one: every embedded field below 1000 is the published one (number, name, type,
enum values); every message decodes with the published classes to the same values as with the embedded descriptor; its
timestamp is its log time. For /scene also: indices lie in the mesh, a tool is where /tool says, and its arrow is as long
as /force and the stated scale say. Prints the number of messages of each checked topic as one JSON object.
"""

import argparse
import collections
import importlib
import math
import sys

from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader

from verdict import verdict

# From here on fields are palpate's own.
FIRST_OWN = 1000


def embedded_class(schema):
    """The class that the log's own descriptor makes."""
    pool = descriptor_pool.DescriptorPool()
    for file in FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))


def published_class(name):
    """The class of Foxglove's package; None for a message that is not theirs."""
    package, _, message = name.rpartition(".")
    if package != "foxglove":
        return None
    return getattr(importlib.import_module(f"foxglove_schemas_protobuf.{message}_pb2"), message)


def kind(field):
    """What two fields must have in common."""
    of = field.message_type or field.enum_type
    return field.name, field.type, field.is_repeated, of.full_name if of else None


def compare_schemas(own, published, seen):
    """Gives what is not as published in an embedded message and in all that it holds."""
    if own.full_name in seen:
        return []
    seen.add(own.full_name)
    problems = []
    for field in own.fields:
        theirs = published.fields_by_number.get(field.number)
        place = f"{own.full_name}.{field.name} = {field.number}"
        if field.number >= FIRST_OWN:
            if theirs is not None:
                problems.append(f"{place} is taken by {theirs.name}")
            continue
        if theirs is None or kind(field) != kind(theirs):
            problems.append(f"{place} is not published so: {theirs and kind(theirs)}")
        elif field.message_type:
            problems += compare_schemas(field.message_type, theirs.message_type, seen)
        elif field.enum_type:
            values = [{v.name: v.number for v in e.values} for e in (field.enum_type, theirs.enum_type)]
            if values[0] != values[1]:
                problems.append(f"{field.enum_type.full_name}: {values[0]}, published {values[1]}")
    return problems


def equal(own, theirs):
    """True if both classes read the same values; what only the published one knows must be empty."""
    for field in theirs.DESCRIPTOR.fields:
        value = getattr(theirs, field.name)
        if field.name not in own.DESCRIPTOR.fields_by_name:
            if len(value) if field.is_repeated else theirs.HasField(field.name):
                return False
            continue
        mine = getattr(own, field.name)
        pairs = list(zip(mine, value, strict=True)) if field.is_repeated else [(mine, value)]
        for a, b in pairs:
            if field.type == FieldDescriptor.TYPE_MESSAGE:
                if not equal(a, b):
                    return False
            elif a != b and not (a != a and b != b):
                return False
    return True


class Scenes:
    """Compares pictures with the records of the same moment."""

    def __init__(self):
        self.tools = {}
        self.forces = {}

    def see(self, topic, message):
        """Notes the newest sample and force of each device, by the prefix of its topics."""
        prefix, _, what = topic.rpartition("/")
        if what == "tool":
            self.tools[prefix.strip("/")] = message.pose.position
        elif what == "force":
            self.forces[prefix.strip("/")] = message.force_n

    def check(self, update):
        """Gives what is wrong in a picture."""
        entities = {entity.id: entity for entity in update.entities}
        problems = []
        mesh = entities.pop("surface").triangles[0]
        if not mesh.indices or max(mesh.indices) >= len(mesh.points) or len(mesh.indices) % 3:
            problems.append("/scene: indices outside the mesh")
        for device, tool in self.tools.items():
            of = f"{device}/" if device else ""
            sphere = entities.pop(f"{of}tool").spheres[0]
            entity = entities.pop(f"{of}force")
            arrow = entity.arrows[0]
            for position in (sphere.pose.position, arrow.pose.position):
                if (position.x, position.y, position.z) != (tool.x, tool.y, tool.z):
                    problems.append(f"/scene: tool {device} is at {position}, /tool says {tool}")
            force = self.forces.get(device)
            newton = math.hypot(force.x, force.y, force.z) if force else 0.0
            scale = float({pair.key: pair.value for pair in entity.metadata}["scale_m_per_n"])
            length = arrow.shaft_length + arrow.head_length
            if abs(length - scale * newton) > 1e-12:
                problems.append(f"/scene: an arrow of {length} m for {newton} N")
            q = arrow.pose.orientation
            along = [1 - 2 * (q.y**2 + q.z**2), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y)]
            if newton > 0 and math.dist([a * newton for a in along], [force.x, force.y, force.z]) > 1e-6 * newton:
                problems.append(f"/scene: the arrow of {force} points along {along}")
            # Of a tool with a shape: a ball and an arrow at each place that it touches.
            touched = entities.pop(f"{of}contacts", None)
            if touched and len(touched.arrows) != len(touched.spheres):
                problems.append(f"/scene: {len(touched.arrows)} arrows at {len(touched.spheres)} contacts of {device}")
        return problems + [f"/scene: an entity {name} of no device" for name in entities]


def check(path):
    """Gives counts by topic of what was compared, and the problems found."""
    counts = collections.Counter()
    problems = []
    classes = {}
    scenes = Scenes()
    with open(path, "rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            topic = channel.topic
            if topic not in classes:
                classes[topic] = embedded_class(schema), published_class(schema.name)
                own, published = classes[topic]
                if published:
                    problems += compare_schemas(own.DESCRIPTOR, published.DESCRIPTOR, set())
            own, published = classes[topic]
            decoded = own.FromString(message.data)
            if published is None:
                scenes.see(topic, decoded)
                continue
            counts[topic] += 1
            theirs = published.FromString(message.data)
            if not equal(decoded, theirs):
                problems.append(f"{topic}: the published class reads another message")
            if topic == "/scene":
                problems += scenes.check(theirs)
            else:
                scenes.see(topic, theirs)
                if theirs.timestamp.ToNanoseconds() != message.log_time:
                    problems.append(f"{topic}: timestamp {theirs.timestamp} at log time {message.log_time}")
    return counts, problems


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log")
    parser.add_argument("--expect", nargs="*", default=[], metavar="TOPIC")
    arguments = parser.parse_args()
    counts, problems = check(arguments.log)
    problems += [f"{topic}: no message" for topic in arguments.expect if not counts[topic]]
    return verdict(dict(sorted(counts.items())), problems)


if __name__ == "__main__":
    sys.exit(main())
