//! Fuzzes [`lookdown_fuzz::image_file`].
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    lookdown_fuzz::image_file::read(bytes);
});
