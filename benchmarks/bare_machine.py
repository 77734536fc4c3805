"""The README's commands on a bare Debian or Ubuntu: as root, and as a normal user.

    python -m benchmarks.bare_machine FOLDER [--suite bookworm] [--mirror URL] [--targets study]
        [--bind /some/folder ...]

As root, with debootstrap. A minimal system is made in FOLDER, with `make` and nothing else of what
the README names; a copy of what git knows of this repository is put into it. Then, in a chroot:
`make NO_APT=1` refuses and names the packages, a normal user's `make` too, root's `make` installs
them and runs each target, and the normal user's copy runs `dftfs`. Each line says what came out;
exit status 1 if one is wrong. `--bind` shows folders of this machine inside (a local package
index); pip's configuration and the resolver's are copied. FOLDER is left for a look.
"""

import argparse
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("/etc/resolv.conf", "/etc/hosts", "/etc/pip.conf")
PASSED = ("PIP_", "HTTP_PROXY", "HTTPS_PROXY", "NO_PROXY", "SSL_CERT")
USER = "newcomer"


def make_root(folder: Path, suite: str, mirror: str) -> None:
    """A minimal system with `make`, a normal user and two copies of the repository."""
    if not (folder / "etc" / "debian_version").exists():
        call = ["debootstrap", "--variant=minbase", "--include=make,ca-certificates", suite, folder]
        subprocess.run([*call, *([mirror] if mirror else [])], check=True,
                       stdout=subprocess.DEVNULL)  # fmt: skip
    for source in COPIED:
        if Path(source).exists():
            subprocess.run(["cp", "-rL", source, folder / Path(source).parent.relative_to("/")])
    for place in ("root/dftfs", f"home/{USER}/dftfs"):
        (folder / place).mkdir(parents=True, exist_ok=True)
        names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True)
        packed = subprocess.run(["tar", "-c", "--null", "-T", "-"], cwd=ROOT, check=True,
                                input=names.stdout, stdout=subprocess.PIPE)  # fmt: skip
        subprocess.run(["tar", "-x", "--no-same-owner"], cwd=folder / place, check=True,
                       input=packed.stdout)  # fmt: skip
    inside(folder, f"id {USER} > /dev/null 2>&1 || useradd -m {USER}; chown -R {USER} /home/{USER}")


@contextmanager
def mounted(folder: Path, bound: Sequence[Path]) -> Iterator[None]:
    """What a running system has in it, and the folders that are to be seen."""
    places = [Path("/proc"), Path("/dev"), *bound]
    for place in places:
        inner = folder / place.relative_to("/")
        inner.mkdir(parents=True, exist_ok=True)
        subprocess.run(["mount", "--bind", place, inner], check=True)
    try:
        yield
    finally:
        for place in reversed(places):
            subprocess.run(["umount", folder / place.relative_to("/")], check=False)


def inside(folder: Path, script: str, user: str = "root") -> tuple[int, list[str], float]:
    """Exit status, printed lines and seconds of a shell script in the system."""
    home = "/root" if user == "root" else f"/home/{user}"
    kept = {k: v for k, v in os.environ.items() if k.upper().startswith(PASSED)}
    path = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
    settings = [f"{k}={v}" for k, v in {"PATH": path, "HOME": home, **kept}.items()]
    command = shlex.join(["env", "-i", *settings, "sh", "-c", f"cd {home} && {script}"])
    switch = (
        [] if user == "root" else ["setpriv", "--reuid", user, "--regid", user, "--init-groups"]
    )
    start = time.monotonic()
    done = subprocess.run(["chroot", folder, *switch, "sh", "-c", command], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)  # fmt: skip
    return done.returncode, done.stdout.strip().splitlines(), time.monotonic() - start


def steps(targets: Sequence[str]) -> Iterator[tuple[str, str, str, int, str]]:
    """What is tried: user, script, and the status and expected of the output that are right."""
    named = "as root: apt-get install python3-venv"
    yield "no apt-get", "root", "cd dftfs && make study NO_APT=1", 2, named
    yield "normal user, nothing installed", USER, "cd dftfs && make study", 2, named
    for target in targets:
        end = {"study": "report: ", "test": " passed"}.get(target, "")
        yield f"make {target} as root", "root", f"cd dftfs && make {target}", 0, end
    yield "make study as a normal user", USER, "cd dftfs && make study DESIGN=ref", 0, "report: "


def main() -> int:
    """Try every step; print one line for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--suite", default="bookworm")
    parser.add_argument("--mirror", default="", help="default: that of debootstrap")
    parser.add_argument("--targets", default="study", help="such as study,test")
    parser.add_argument("--bind", type=Path, nargs="*", default=[])
    asked = parser.parse_args()
    if os.geteuid() != 0:
        parser.error("a chroot needs root")
    folder, wrong = asked.folder.resolve(), 0
    make_root(folder, asked.suite, asked.mirror)
    with mounted(folder, [place.resolve() for place in asked.bind]):
        for name, user, script, status, expected in steps(asked.targets.split(",")):
            got, lines, seconds = inside(folder, script, user)
            right = got == status and any(expected in line for line in lines)
            wrong += not right
            shown = next((x for x in lines if expected in x), lines[-1] if lines else "")
            print(f"{'pass' if right else 'FAIL'}  {name}: status {got}, {seconds:.0f} s: {shown}")
            print(*(lines if not right else [x for x in lines if "[setup]" in x]),
                  sep="\n      ", flush=True)  # fmt: skip
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
