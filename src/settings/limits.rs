//! The cost of one frame, and of all frames together.

use std::num::{NonZeroU32, NonZeroU64, NonZeroUsize};

use super::{
    ServerSettings, SettingsError,
    declare::settings,
    form::{MAX_BYTES, count, rate, whole},
};

/// The longest side that the JPEG format can state.
const MAX_IMAGE_SIDE: u64 = 65_535;

settings! {
    /// The cost of one frame, and of all frames together.
    #[derive(Debug, Clone, PartialEq)]
    pub struct LimitSettings in "limits" {
        /// The longest side of a frame in pixels, checked before it is decoded.
        max_image_side: u32 = 8192 => whole(1..=MAX_IMAGE_SIDE);
        /// The most pixels of a frame, checked before it is decoded.
        max_image_pixels: u64 = 50_000_000 => whole(1..=MAX_IMAGE_SIDE * MAX_IMAGE_SIDE);
        /// The most memory for decoding one frame, in bytes.
        max_decode_bytes: u64 = 512 << 20 => whole(1..=MAX_BYTES);
        /// The most frames that wait for a worker or are processed. Further ones are answered with
        /// 429. One of several clients may have half of them. A frame counts 1 more for each 8
        /// megapixels that are decoded or drawn, and for each 32 inputs of the network, half of
        /// the limit at most.
        max_frames_in_flight: NonZeroUsize = NonZeroUsize::new(16).unwrap_or(NonZeroUsize::MIN)
            => count();
        /// The most memory for all request bodies together, and for the tensors that are unpacked
        /// from them (four bytes a number), in bytes. Further ones are answered with 429. Responses
        /// of more than 64 KiB that clients have not read yet may use as much again. At least
        /// `server.max_body_bytes`. One of several clients may use half of it.
        max_upload_bytes: usize = 256 << 20 => whole(1024..=MAX_BYTES);
        /// The least bytes a second of a request body, over five seconds. A slower one is answered
        /// with 408. 0: no limit.
        min_upload_bytes_per_second: Option<NonZeroU64> = NonZeroU64::new(1024) => whole(0..=2 << 30);
        /// The requests a second that a client may send in the long run. Further ones are answered
        /// with 429. 0: no limit. A client is an API key, and without one an address. Health
        /// checks, metrics and pages are not counted.
        requests_per_second: Option<f64> = None => rate(0.02..=100_000.0);
        /// The requests that a client may send at once after a pause.
        request_burst: NonZeroU32 = NonZeroU32::new(20).unwrap_or(NonZeroU32::MIN) => count();
    }
}

impl LimitSettings {
    /// The limits, if they leave room for the largest body.
    pub(super) fn checked(self, server: &ServerSettings) -> Result<Self, SettingsError> {
        if self.max_upload_bytes < server.max_body_bytes {
            return Err(SettingsError::value(
                "limits.max_upload_bytes",
                self.max_upload_bytes.to_string(),
                format!(
                    "give at least server.max_body_bytes, {}",
                    server.max_body_bytes
                ),
            ));
        }
        Ok(self)
    }
}
