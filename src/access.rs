//! Access control: API keys with a name and scopes. Only the digests of keys are stored.

mod key_list;
mod scope;

pub use key_list::{AccessKeys, Holder, InvalidKeyName, KeyDigest, KeyList, KeyName, new_key};
pub use scope::{Scope, Scopes};
