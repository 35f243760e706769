//! The `weavelight` command.

fn main() -> std::process::ExitCode {
    weavelight::cli::main()
}
