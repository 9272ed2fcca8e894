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
use crate::access::{AccessKeys, Holder, Scope};

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
    /// Checks that the keys allow `wanted` to the request with these headers. Returns the holder of
    /// its key, if there are keys.
    pub(in crate::api) fn check(
        &self,
        headers: &HeaderMap,
        wanted: Scope,
    ) -> Result<Option<Holder>, Problem> {
        self.check_with(headers, None, wanted)
    }

    /// Like [`Self::check`], for a request whose key may be in a form.
    pub(in crate::api) fn check_with(
        &self,
        headers: &HeaderMap,
        in_form: Option<&str>,
        wanted: Scope,
    ) -> Result<Option<Holder>, Problem> {
        let Self::Keys(keys) = self else {
            return Ok(None);
        };
        let key = only_key(presented(headers).chain(in_form.map(str::as_bytes)))?;
        let holder = keys.holder_of(key).ok_or_else(|| {
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
        cors_origins: &[String],
        hosts: &[String],
    ) -> Option<AllowedOrigins> {
        match self {
            Self::Open { own_machine_only } => Some(AllowedOrigins {
                own_machine_only: *own_machine_only,
                allowed: cors_origins.into(),
                hosts: hosts.into(),
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

    /// Returns the holder of the request's key, if the key is valid.
    pub(in crate::api) fn holder(&self, headers: &HeaderMap) -> Option<Holder> {
        match self {
            Self::Open { .. } => None,
            Self::Keys(keys) => keys.holder_of(only_key(presented(headers)).ok()?),
        }
    }

    /// Like [`Self::check`]. Without keys, only a server that no other machine can reach allows the
    /// request.
    pub(in crate::api) fn check_of_its_own(
        &self,
        headers: &HeaderMap,
        wanted: Scope,
    ) -> Result<(), Problem> {
        match self {
            Self::Open {
                own_machine_only: false,
            } => {
                let detail = "without keys, clients of an open server (access.open) may only detect \
                              and read: set access.keys_file and send a key with the scope admin";
                Err(Problem::new(ProblemKind::Forbidden, detail))
            }
            _ => self.check(headers, wanted).map(drop),
        }
    }
}

/// Returns `true` if these headers hold any key, valid or not.
pub(in crate::api) fn shows_key(headers: &HeaderMap) -> bool {
    presented(headers).next().is_some()
}
