#!/usr/bin/env python3
"""Checks that every topic and field that a ready-made layout names exists in a log.

    ci/check_layouts.py LOG.mcap LAYOUT...

LAYOUT is a Foxglove or Lichtblick layout (.json) or one of PlotJuggler (.xml). A path holds if the log declares its topic and
the message's embedded descriptor has the field, and if at least one message of the topic was written: a viewer shows nothing
else. Prints the number of paths of each layout as one JSON object.
"""

import json
import os
import sys
import xml.etree.ElementTree

from google.protobuf import descriptor_pool
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader

from verdict import verdict

# Of each type of panel: the keys of its settings that are a topic or a path.
PANELS = {
    "3D": lambda panel: panel["topics"],
    "Plot": lambda panel: [path["value"] for path in panel["paths"]],
    "RosOut": lambda panel: [panel["topicToRender"]],
    "RawMessages": lambda panel: [panel["topicPath"]],
}
# Events come when something happens: a log need not have one.
MAY_BE_EMPTY = {"/log"}


def topics(log):
    """The descriptor of each topic's message, and how many messages there are."""
    with open(log, "rb") as stream:
        summary = make_reader(stream).get_summary()
    found = {}
    for id, channel in summary.channels.items():
        schema = summary.schemas[channel.schema_id]
        pool = descriptor_pool.DescriptorPool()
        for file in FileDescriptorSet.FromString(schema.data).file:
            pool.Add(file)
        count = summary.statistics.channel_message_counts.get(id, 0)
        found[channel.topic] = pool.FindMessageTypeByName(schema.name), count
    return found


def foxglove_paths(text):
    """(topic, fields) of everything that the panels show, and panels that the layout arranges but does not have."""
    layout = json.loads(text)
    panels = layout["configById"]
    paths = []
    for id, panel in panels.items():
        for path in PANELS[id.split("!")[0]](panel):
            topic, *fields = path.split(".")
            paths.append((topic, fields))

    def arranged(node):
        return {node} if isinstance(node, str) else arranged(node["first"]) | arranged(node["second"])

    return paths, arranged(layout["layout"]) ^ set(panels)


def plotjuggler_paths(text, known):
    """The same for curves, which are a topic and its fields with slashes between."""
    paths = []
    for curve in xml.etree.ElementTree.fromstring(text).iter("curve"):
        name = curve.attrib["name"]
        topic = max((topic for topic in known if name.startswith(f"{topic}/")), key=len, default=name)
        paths.append((topic, name[len(topic) + 1 :].split("/")))
    return paths, set()


def problem(topic, fields, known):
    """What is wrong with a path; None if it holds."""
    if topic not in known:
        return "no such topic"
    message, count = known[topic]
    if count == 0 and topic not in MAY_BE_EMPTY:
        return "a topic without a message"
    for field in fields:
        if message is None or field not in message.fields_by_name:
            return f"no field {field}"
        message = message.fields_by_name[field].message_type
    return "a message, not a number" if fields and message is not None else None


def main():
    log, *layouts = sys.argv[1:]
    known = topics(log)
    counts = {}
    problems = []
    for layout in layouts:
        name = os.path.basename(layout)
        with open(layout, encoding="utf-8") as stream:
            text = stream.read()
        paths, strays = foxglove_paths(text) if layout.endswith(".json") else plotjuggler_paths(text, known)
        counts[name] = len(paths)
        problems += [f"{name}: {id} is arranged or set up, not both" for id in strays]
        found = [(topic, fields, problem(topic, fields, known)) for topic, fields in paths]
        problems += [f"{name}: {topic} {'.'.join(fields)}: {what}" for topic, fields, what in found if what]
    problems += [f"{name}: no topic" for name, count in counts.items() if not count]
    return verdict(counts, problems)


if __name__ == "__main__":
    sys.exit(main())
