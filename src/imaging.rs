//! Pixels: decoding with limits, lens circle detection, privacy masks, remap tables, network input,
//! drawing.

pub mod annotate;
pub mod decode;
pub mod frame;
pub mod lens_circle;
mod letterbox;
mod masked_pixels;
mod network_input;
pub mod picture_grid;
mod pixel_memory;
mod remap_table;
mod thumbnail;
mod view_signature;

pub use frame::{Frame, FrameError};
pub use letterbox::Letterbox;
pub use masked_pixels::MaskedPixels;
pub use network_input::{ChannelOrder, NetworkInput, ViewBatch};
pub use remap_table::RemapTable;
pub use thumbnail::{narrowed, thumbnail};
pub use view_signature::ViewSignature;
