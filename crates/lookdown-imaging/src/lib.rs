//! Pixels: decoding with limits, lens circle detection, privacy masks, remap tables, network input,
//! drawing.

pub mod annotate;
mod buffer_pool;
mod cell_motion;
pub mod decode;
pub mod edge_curves;
mod even_light;
pub mod frame;
mod frame_signature;
pub mod lens_circle;
mod letterbox;
mod masked_pixels;
mod network_input;
mod remap_table;
pub mod room_fit;
mod view_signature;

pub use cell_motion::{MovedCell, NEW_LEVELS, is_noise};
pub use even_light::with_even_light;
pub use frame::narrowed;
pub use frame::{Frame, FrameError};
pub use frame_signature::FrameSignature;
pub use letterbox::Letterbox;
pub use masked_pixels::MaskedPixels;
pub use network_input::{ChannelOrder, NetworkInput, ViewBatch};
pub use remap_table::RemapTable;
pub use view_signature::ViewSignature;
