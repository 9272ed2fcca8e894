//! Lookdown
fn main() {}
