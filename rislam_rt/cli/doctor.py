"""`rislam-rt doctor`."""

import typer

from rislam_rt.cli.options import JsonFile, write_json


def command(json: JsonFile = None) -> None:
    """Say what this machine has, and trace a small box to prove it. Exit code 3 if something is missing."""
    from rislam_rt.backend import diagnose, prepare_backend

    findings = diagnose()
    width = max(len(finding.name) for finding in findings)
    for finding in findings:
        if not finding.ok and finding.name == "backend":
            continue  # `prepare_backend` says it below, and ends the command
        typer.echo(f"{'ok ' if finding.ok else 'BAD'} {finding.name:<{width}}  {finding.value}")
    prepare_backend()
    from rislam_rt.channel.traced import trace_small_box

    proof = trace_small_box()
    typer.echo(f"ok  {'small box':<{width}}  {proof}")
    rows = [{"name": finding.name, "value": finding.value, "ok": finding.ok} for finding in findings]
    write_json(json, {"findings": rows, "small_box": str(proof)})
