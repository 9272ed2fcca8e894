//! Access control: API keys with a name and scopes. Only the digests of keys are stored.

mod digest;
mod error;
mod key_list;
mod key_name;
mod keys;
mod priority_level;
mod scope;

pub use digest::{KeyDigest, new_key};
pub use error::KeyError;
pub use key_list::{Holder, KeyList};
pub use key_name::{InvalidKeyName, KeyName};
pub use keys::AccessKeys;
pub use priority_level::{InvalidPriorityLevel, PriorityLevel};
pub use scope::{Scope, Scopes};
