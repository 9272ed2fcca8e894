//! The sample frames, which are built into the program with their calibrations.

/// A sample frame.
pub(crate) struct Sample {
    /// The name of its file.
    pub(crate) file: &'static str,
    /// The file.
    pub(crate) jpeg: &'static [u8],
    /// The native calibration.
    pub(crate) calibration: &'static str,
}

macro_rules! samples {
    ($($name:literal),*) => {
        /// The names, in the order of the page.
        #[cfg(test)]
        pub(crate) const NAMES: &[&str] = &[$($name),*];

        /// The samples, in the order of the page.
        pub(crate) static SAMPLES: &[Sample] = &[$(Sample {
            file: concat!($name, ".jpg"),
            jpeg: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/samples/", $name, ".jpg")),
            calibration: include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/samples/calibrations/",
                $name,
                ".json"
            )),
        }),*];
    };
}

samples!["office", "canteen", "lounge"];

#[cfg(test)]
mod tests {
    use super::NAMES;

    #[test]
    fn the_page_offers_each_sample() {
        let list = format!("const samples = {NAMES:?}.map(");
        assert!(include_str!("../web/frame.js").contains(&list), "{list}");
    }
}
