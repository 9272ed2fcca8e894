//! The `lookdown` binary.
fn main() {}
