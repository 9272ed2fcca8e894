//! Access control: API keys with a name and scopes. Only the digests of keys are stored.

mod digest;
mod key_list;
mod keys;
mod scope;

pub use digest::{KeyDigest, new_key};
pub use key_list::{Holder, InvalidKeyName, KeyList, KeyName};
pub use keys::AccessKeys;
pub use scope::{Scope, Scopes};
