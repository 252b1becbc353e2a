//! The command `bitlight`: see `bitlight --help`.

fn main() -> std::process::ExitCode {
    bitlight::cli::main()
}
