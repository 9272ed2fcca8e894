//! Fetches the weights of a model and verifies their SHA-256: converted weights, or the file that
//! the authors of the network publish.

mod converted;
mod error;
mod source;
mod upstream;

pub use self::{
    converted::fetch_weights,
    error::FetchError,
    source::ModelSource,
    upstream::{Installed, Sha256Sum, fetch_upstream},
};
