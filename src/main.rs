//! The command `bitlight`: see `bitlight --help`.

fn main() -> std::process::ExitCode {
    bitlight::run::keep_memory();
    bitlight::cli::main()
}
