//! Authorization. With API keys, a request needs a key with the required scope. Without keys, a
//! loopback server permits everything to clients on the same machine, and an open server
//! (`access.open`) permits every client to detect and read.

use std::sync::Arc;

use axum::http::HeaderMap;
use lookdown_http::{
    csrf::{AllowedOrigins, Remedies},
    keys::{only_key, presented},
};

use super::problem::{Problem, ProblemKind};
use crate::{
    access::{AccessKeys, Holder, Scope},
    settings::AccessSettings,
};

/// The access rules of the server.
#[derive(Debug, Clone)]
pub enum Access {
    /// The server has no keys.
    Open {
        /// `true` if only clients on the same machine reach the server. They may then make changes.
        /// `false` with `access.open`.
        own_machine_only: bool,
    },
    /// Every request needs a key.
    Keys(Arc<AccessKeys>),
}

impl Access {
    /// Compares the key in the headers with all known keys, if there is exactly one.
    pub(in crate::api) fn identify(&self, headers: &HeaderMap) -> Option<Holder> {
        self.holder_of(only_key(presented(headers)).ok()?)
    }

    /// Checks that the keys allow `wanted` to the request with these headers, whose only key is
    /// that of `holder`. Its key may also be `elsewhere`, as in a form. Returns the holder of its
    /// key, if there are keys. Without keys, only a server that no other machine can reach allows
    /// changes.
    pub(in crate::api) fn check(
        &self,
        headers: &HeaderMap,
        holder: Option<&Holder>,
        elsewhere: Option<&str>,
        wanted: Scope,
    ) -> Result<Option<Holder>, Problem> {
        match self {
            Self::Open {
                own_machine_only: false,
            } if wanted == Scope::Admin => {
                let detail = "without keys, clients of an open server (access.open) may only detect \
                              and read: set access.keys_file and send a key with the scope admin";
                return Err(Problem::new(ProblemKind::Forbidden, detail));
            }
            Self::Open { .. } => return Ok(None),
            Self::Keys(_) => {}
        }
        let key = only_key(presented(headers).chain(elsewhere.map(str::as_bytes)))?;
        let holder = match elsewhere {
            Some(_) => self.holder_of(key),
            None => holder.cloned(),
        };
        let holder = holder.ok_or_else(|| {
            let detail = "the key is not valid: it was mistyped, or the server's operator \
                          has removed it";
            Problem::new(ProblemKind::KeyRequired, detail)
        })?;
        if holder.scopes.allow(wanted) {
            return Ok(Some(holder));
        }
        let detail = format!(
            "the key {} has the scope {}: this needs a key with the scope {wanted}",
            holder.name,
            holder.scopes.joined(" and "),
        );
        Err(Problem::new(ProblemKind::Forbidden, detail))
    }

    /// Returns the origins that may make changes; `None` if there are keys.
    pub(in crate::api) fn allowed_origins(
        &self,
        settings: &AccessSettings,
    ) -> Option<AllowedOrigins> {
        match self {
            Self::Open { own_machine_only } => Some(AllowedOrigins {
                own_machine_only: *own_machine_only,
                allowed: settings.cors_origins.as_slice().into(),
                hosts: settings.hosts.as_slice().into(),
                remedies: Remedies {
                    keys: "access.keys_file",
                    hosts: "add the name to access.hosts",
                    origins: "add a trusted origin to access.cors_origins",
                },
            }),
            Self::Keys(_) => None,
        }
    }

    /// Returns `true` if every request needs a key.
    pub(in crate::api) fn needs_keys(&self) -> bool {
        matches!(self, Self::Keys(_))
    }

    fn holder_of(&self, key: &[u8]) -> Option<Holder> {
        match self {
            Self::Open { .. } => None,
            Self::Keys(keys) => keys.holder_of(key),
        }
    }
}

/// Returns `true` if these headers hold any key, valid or not.
pub(in crate::api) fn shows_key(headers: &HeaderMap) -> bool {
    presented(headers).next().is_some()
}
