"""The load monitor on controllers: `python tests/firmware.py`.

Writes the constants of the packaged machine with `guideload monitor build`, and the packaged trace as counts; then
    builds the firmware for a Cortex-M7 and looks for panics in its symbols, and for its size in flash and memory;
    runs it in QEMU, compares its loads with those of the same monitor on this machine, and counts instructions;
    builds the C library for Cortex-M7 and RISC-V, and runs its example on this machine, also with the sanitizers for
    addresses and undefined behaviour of the C compiler.

What is not installed is left out, and the last lines say so: the Rust targets thumbv7em-none-eabihf and
riscv32imac-unknown-none-elf (`rustup target add ...`), qemu-system-arm, and a C compiler. Exit code 1 if a limit is
passed or loads differ.
"""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from guideload import Machine, motion_from_trace, read_trace
from guideload.monitor import Design, MonitorSettings, designed
from guideload.monitor.design import SampledPath
from guideload.monitor.source import c_source, rust_source

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "python" / "guideload" / "examples"
FIRMWARE, LIBRARY = ROOT / "rust" / "firmware", ROOT / "rust" / "monitor-c"
ARM, RISCV = "thumbv7em-none-eabihf", "riscv32imac-unknown-none-elf"

PERIOD, QUANTUM, LAG = 1e-3, 20e-6, 20  # s, m, samples
PRINTED = 97  # samples between two printed loads
LOOP_INSTRUCTIONS = 200_000  # of the loop that tells instructions from ticks
# Limits: instructions of the worst sample, bytes of flash without the counts and of memory; error in f32.
INSTRUCTIONS, FLASH, MEMORY, SINGLE = 6000, 96 * 1024, 8 * 1024, 1e-5


def main() -> None:
    """Do all that can be done here."""
    left_out: list[str] = []
    machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
    motion = motion_from_trace(read_trace(EXAMPLES / "manipulator.csv"), machine.drive)
    settings = MonitorSettings(period=PERIOD, travel_per_count=QUANTUM, lag=LAG, max_acceleration=20.0)
    design = designed(machine, motion, settings)
    print(
        f"smoother: order {design.order}, time constant {design.time_constant} samples; peaks on the trace within "
        f"{100 * design.peak_error:.2f} %, loads within {design.load_error:.0f} N rms"
    )
    still = int(design.monitor().constants()["settling"]) + 100
    position = np.pad(SampledPath.of(machine, motion, settings).position, (still, LAG), mode="edge")
    counts = (np.round(position / QUANTUM).astype(np.int64) & 0xFFFF_FFFF).astype(np.uint32)
    targets = installed_targets()
    with tempfile.TemporaryDirectory() as folder:
        if ARM in targets:
            program = firmware(Path(folder), design, counts)
            if shutil.which("qemu-system-arm"):
                replay(program, design, counts)
            else:
                left_out.append("run of the firmware: qemu-system-arm is not installed")
        else:
            left_out.append(f"firmware: rustup target add {ARM}")
        for target in (ARM, RISCV):
            if target in targets:
                cargo(LIBRARY, "--target", target)
                print(f"C library for {target}: built")
            else:
                left_out.append(f"C library for {target}: rustup target add {target}")
        if shutil.which("cc") and shutil.which("make"):
            c_example(Path(folder), design, counts, left_out)
        else:
            left_out.append("C example: no C compiler or make")
    for each in left_out:
        print(f"LEFT OUT: {each}")


def installed_targets() -> str:
    """Names of the Rust targets that are there."""
    if shutil.which("rustup") is None:
        return ""
    done = subprocess.run(("rustup", "target", "list", "--installed"), capture_output=True, text=True)
    return done.stdout


def cargo(folder: Path, *options: str, **environment: str) -> Path:
    """Builds a crate in its folder; the folder of its targets."""
    command = ("cargo", "build", "--release", "--quiet", *options)
    subprocess.run(command, cwd=folder, env=os.environ | environment, check=True)
    return Path(os.environ.get("CARGO_TARGET_DIR", folder / "target"))


def firmware(folder: Path, design: Design, counts: np.ndarray) -> Path:
    """The program, with its symbols and sizes checked."""
    (folder / "monitor.rs").write_text(rust_source(design))
    numbers = ",".join(map(str, counts))
    (folder / "counts.rs").write_text(
        f"pub static COUNTS: [u32; {counts.size}] = [{numbers}];\npub const PRINTED: usize = {PRINTED};\n"
    )
    target = cargo(FIRMWARE, GUIDELOAD_GENERATED=str(folder))
    program = target / ARM / "release" / "guideload-firmware"
    symbols, text, data = elf(program.read_bytes())
    # The handler itself is `rust_begin_unwind`; it is linked only if something can panic.
    panics = [
        name for name in symbols if "panic" in name or "rust_begin_unwind" in name or "unwrap_failed" in name
    ]
    require(not panics, f"panics in the image: {panics}")
    flash = text + data - 4 * counts.size
    print(
        f"firmware: flash {flash} bytes without {4 * counts.size} of counts; no panic among {len(symbols)} symbols"
    )
    require(flash <= FLASH, f"flash: {flash} bytes, expected at most {FLASH}")
    return program


def elf(image: bytes) -> tuple[list[str], int, int]:
    """Names of the symbols, bytes of code and constants, and bytes of initialised data of an ELF file of 32 bits."""
    start, size, count = (*struct.unpack_from("<I", image, 32), *struct.unpack_from("<HH", image, 46))
    sections = [struct.unpack_from("<10I", image, start + size * k) for k in range(count)]
    symbols, text, data = [], 0, 0
    for section in sections:
        _, kind, flags, _, offset, length, link, *_ = section
        if kind == 2:  # symbols
            base = sections[link][4]
            for at in range(offset, offset + length, 16):
                begin = base + struct.unpack_from("<I", image, at)[0]
                symbols.append(image[begin : image.index(b"\0", begin)].decode())
        elif kind == 1 and flags & 2:  # in the memory image
            text, data = (text, data + length) if flags & 1 else (text + length, data)
    return symbols, text, data


def replay(program: Path, design: Design, counts: np.ndarray) -> None:
    """Runs the firmware, and compares it with the monitor of this machine."""
    emulator = "qemu-system-arm -M mps2-an500 -display none -serial null -monitor none"
    options = "-semihosting-config enable=on,target=native -icount shift=8 -kernel"
    command = (*emulator.split(), *options.split(), str(program))
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    lines = [line.split() for line in (done.stdout + done.stderr).splitlines() if line]
    by_name: dict[str, list[list[int]]] = {}
    for name, *numbers in lines:
        by_name.setdefault(name, []).append([int(number, 16) for number in numbers])
    require("carriage" in by_name, f"the firmware did not reach its end: {lines[-3:]}")
    monitor = design.monitor()
    _, periods, loads = monitor.push(np.arange(counts.size, dtype=np.uint32), counts)
    by_period = {int(period): load for period, load in zip(periods, loads, strict=True)}
    scale, worst = float(np.abs(loads).max()), 0.0
    for period, *bits in by_name["loads"]:
        worst = max(worst, float(np.abs(reals(bits) - by_period[period].ravel()).max()))
    totals = monitor.totals()
    for carriage, power, *bits in by_name["carriage"]:
        require(
            abs(reals([power])[0] / totals["power"][carriage] - 1.0) < SINGLE, "integrals of the life differ"
        )
        extremes = np.stack([totals["smallest"][carriage], totals["largest"][carriage]], axis=1).ravel()
        deviation = np.abs(reals(bits) - extremes) / np.where(np.arange(14) // 2 == 5, scale, 1.0)
        worst = max(worst, float(deviation.max()))
    require(worst < SINGLE * scale, f"loads in f32 differ by {worst:.3g} N of {scale:.0f} N")
    print(
        f"QEMU: {len(by_name['loads'])} instants and all extremes within {worst / scale:.1e} of the largest load"
    )
    per_tick = LOOP_INSTRUCTIONS / by_name["loop"][0][0]
    (total, measured, longest), (memory, constants) = by_name["ticks"][0], by_name["bytes"][0]
    mean, most = per_tick * total / measured, per_tick * longest
    print(f"instructions per sample: {mean:.0f}, at most {most:.0f} ({most / mean:.2f} times the mean)")
    print(f"memory {memory} bytes, constants {constants} bytes")
    require(most <= INSTRUCTIONS, f"{most:.0f} instructions, expected at most {INSTRUCTIONS}")
    require(memory <= MEMORY, f"memory: {memory} bytes, expected at most {MEMORY}")


def c_example(folder: Path, design: Design, counts: np.ndarray, left_out: list[str]) -> None:
    """Builds and runs the example in C, also with sanitizers, and compares its loads."""
    (folder / "machine.h").write_text(c_source(design))
    numbers = ",".join(f"{count}u" for count in counts)
    (folder / "counts.h").write_text(
        f"#include <stdint.h>\nstatic const uint32_t counts[] = {{{numbers}}};\n"
    )
    target = cargo(LIBRARY)
    example = str(LIBRARY / "example")
    command = ("make", "-s", "-C", example, f"GENERATED={folder}", f"LIBRARY={target}/release", "run")
    sanitizers = "-fsanitize=address,undefined"
    empty = ("cc", sanitizers, "-x", "c", "-", "-o", str(folder / "empty"))
    kinds = ["-O2"]
    if subprocess.run(empty, input=b"int main(void) { return 0; }", capture_output=True).returncode == 0:
        kinds.insert(0, f"-O1 -g {sanitizers} -fno-sanitize-recover=all")
    else:
        left_out.append("C example with sanitizers: the C compiler has none")
    for flags in kinds:
        again = (*command, "-B", f"CFLAGS={flags} -std=c11 -Wall -Wextra -Werror -pedantic")
        done = subprocess.run(again, capture_output=True, text=True, check=False)
        require(done.returncode == 0, f"the C example failed: {done.stdout}{done.stderr[:2000]}")
    lines = [line.split() for line in done.stdout.splitlines()]
    found = np.array([float(words[1]) for words in lines if words[0] == "largest"])
    monitor = design.monitor()
    monitor.push(np.arange(counts.size, dtype=np.uint32), counts)
    expected = np.array(monitor.totals()["largest"])[:, 6]
    require(bool(np.allclose(found, expected, rtol=SINGLE)), f"C: {found}, here: {expected}")
    print(f"C example: {done.stdout.splitlines()[-1]}")


def reals(bits: list[int]) -> np.ndarray:
    """Numbers in single precision from their bits."""
    return np.array(bits, dtype=np.uint32).view(np.float32).astype(np.float64)


def require(holds: bool, otherwise: str) -> None:
    """Ends with a message if something does not hold."""
    if not holds:
        sys.exit(f"firmware: {otherwise}")


if __name__ == "__main__":
    main()
