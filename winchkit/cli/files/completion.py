"""``winchkit completion``: the script that lets a shell complete commands, benches and winches."""

from __future__ import annotations

import click

from winchkit.cli.core.command import ToolCommand

_SHELLS = ("bash", "zsh", "fish")


@click.command(
    cls=ToolCommand,
    examples=("winchkit completion bash", "winchkit completion fish > winchkit.fish"),
)
@click.argument("shell", type=click.Choice(_SHELLS))
@click.pass_context
def command(ctx: click.Context, shell: str) -> None:
    """Print the completion script for SHELL.

    bash: eval "$(winchkit completion bash)" in ~/.bashrc; zsh: the same in ~/.zshrc; fish:
    winchkit completion fish > ~/.config/fish/completions/winchkit.fish.
    """
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None, "click knows these shells"
    script = found(ctx.find_root().command, {}, "winchkit", "_WINCHKIT_COMPLETE")
    # Not source(): for bash that runs bash to learn its version.
    click.echo(script.source_template % script.source_vars())
