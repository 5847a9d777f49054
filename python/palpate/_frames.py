"""Runs and tables as pandas.DataFrame. pandas is needed only here."""


def _pandas():
    try:
        import pandas
    except ImportError as error:
        raise ImportError("to_pandas() needs pandas: pip install pandas") from error
    return pandas


def of_table(table):
    return _pandas().DataFrame({name: table[name] for name in table.columns}, copy=False)


def of_run(run):
    """One row per haptic tick, by its time: force, commanded force, tool, contact."""
    pandas = _pandas()
    force, tool, velocity = run.force, run.tool, run.velocity
    columns = {}
    for name, array in [("f{}_n", force), ("{}_m", tool), ("v{}_m_s", velocity)]:
        for axis, letter in enumerate("xyz"):
            columns[name.format(letter)] = array[:, axis]
    if run.torque is not None:
        for axis, letter in enumerate("xyz"):
            columns[f"t{letter}_n_m"] = run.torque[:, axis]
    if run.orientation is not None:
        for axis, letter in enumerate("wxyz"):
            columns[f"q{letter}"] = run.orientation[:, axis]
    frame = pandas.DataFrame(columns, index=pandas.Index(run.time, name="t_s"))
    contacts = of_table(run.contacts).set_index("t_s")
    return frame.join(contacts[["mode", "triangle", "normal_force_n", "tangential_force_n", "count", "area_m2"]])
