"""A finding's sentence is made last, and those that differ only in their recording are grouped."""

from rsea_core.recordings.finding import Finding, Kind, grouped_sentences


def test_a_sentence_begins_with_the_file_and_ends_as_it_is_meant():
    asked = Finding(kind=Kind.SUPPLY, text="supply_V is 48e3: mV", file="a.csv", is_question=True)
    assert asked.sentence() == "a.csv: supply_V is 48e3: mV?"
    assert Finding(kind=Kind.SILENT, text="nothing moves").sentence() == "nothing moves"


def test_what_every_recording_has_is_reported_once_and_last():
    jitter = [
        Finding(
            kind=Kind.RESAMPLED, text=f"sample times vary by {20 + k} %", file=f"loop{k}.csv",
            column="time_s",
        )
        for k in range(3)
    ]  # fmt: skip
    dead = Finding(
        kind=Kind.SENSOR_DEAD, text="torque_Nm never moves", file="a.csv", column="torque_Nm"
    )
    assert grouped_sentences([*jitter, dead]) == (
        "a.csv: torque_Nm never moves",
        "loop0.csv: sample times vary by 20 % (and similarly in 2 more)",
    )


def test_findings_of_the_whole_case_are_never_grouped():
    notes = [Finding(kind=Kind.METHOD, text=message) for message in ("one", "two")]
    assert grouped_sentences(notes) == ("one", "two")
