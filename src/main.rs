//! The `weavelight` command.

fn main() -> std::process::ExitCode {
    weavelight::machine::correct_environment();
    weavelight::files::survive_size_limits();
    weavelight::cli::main()
}
