"""The command `rislam-rt doctor`: checks that this machine has what the ray tracer needs."""

import typer

from rislam_rt.cli.options import JsonFile
from rislam_rt.cli.output_files import write_json


def command(json: JsonFile = None) -> None:
    """Say what this machine has, and trace a small box to prove it. Exit code 3 if something is missing.

    Example: rislam-rt doctor --json doctor.json
    """
    from dataclasses import asdict

    from rislam_rt.tracer_backend import diagnose, prepare_backend

    findings = diagnose()
    width = max(len(finding.name) for finding in findings)
    for finding in findings:
        if not finding.ok and finding.name == "backend":
            continue  # `prepare_backend` says it below, and ends the command
        typer.echo(f"{'ok ' if finding.ok else 'BAD'} {finding.name:<{width}}  {finding.value}")
    prepare_backend()
    from rislam_rt.channel.traced import trace_small_box
    from rislam_rt.errors import TraceError

    proof = trace_small_box()
    error = max(proof.los_error_db, proof.wall_error_db)
    text = f"{proof.num_paths} of {proof.expected_paths} paths, gain within {error:.1g} dB of theory"
    typer.echo(f"{'ok ' if proof.ok else 'BAD'} {'small box':<{width}}  {text}, {proof.seconds:.1f} s")
    rows = [{"name": finding.name, "value": finding.value, "ok": finding.ok} for finding in findings]
    write_json(json, {"findings": rows, "small_box": {"ok": proof.ok, **asdict(proof)}})
    if not proof.ok:
        raise TraceError(f"small box: {text}; the tracer's libraries are damaged, run 'make clean' and 'make demo'")
