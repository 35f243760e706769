//! The `weavelight` command.

fn main() -> std::process::ExitCode {
    weavelight::files::survive_size_limits();
    weavelight::cli::main()
}
