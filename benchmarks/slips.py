"""The forty slips of `dftfs doctor` on ten cases: how many are noticed, and which pass.

    python -m benchmarks.slips CASES [--cases 10]

CASES is a folder of practice cases. Prints the number noticed of each case, what the checks report
of the cases as they are (false alarms), and the slips that pass with the cases where they do.
"""

import argparse
from pathlib import Path

from rsea_core.importing.doctor.slip_catalogue import case_slips, try_slips
from rsea_core.recordings.case import read_case


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("--cases", dest="number", type=int, default=10)
    arguments = parser.parse_args()
    passed: dict[str, list[str]] = {}
    noticed = []
    for path in sorted(arguments.cases.iterdir())[: arguments.number]:
        case = read_case(path)
        results = try_slips(case)
        own = [r for r in results if r.noticed]
        for result in results:
            if not result.noticed:
                kind = "" if result.noticed is False else " (not applicable)"
                passed.setdefault(result.name + kind, []).append(case.name)
        noticed.append(len(own))
        alarms = [f.sentence() for f in case_slips(case)]
        print(f"{case.name}: {len(own)} of {len(results)} noticed; as it is: {alarms or 'nothing'}")
    print(f"mean {sum(noticed) / len(noticed):.1f}, least {min(noticed)}")
    for name, names in sorted(passed.items(), key=lambda item: -len(item[1])):
        print(f"passes: {name}: {', '.join(names)}")


if __name__ == "__main__":
    main()
