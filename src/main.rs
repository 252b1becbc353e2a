//! The command `bitlight`: see `bitlight --help`.

fn main() {}
