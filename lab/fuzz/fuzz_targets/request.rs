//! Fuzzes [`lookdown_fuzz::request`].
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    lookdown_fuzz::request::read(bytes);
});
