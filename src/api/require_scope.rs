//! Extractors that prove a scope: the only handlers without one are health checks, metrics and
//! documentation.

use std::marker::PhantomData;

use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, request::Parts},
};

use lookdown_http::keys::basic_password;

use super::{
    ApiState,
    http::{context::RequestContext, problem::Problem},
};
use crate::access::{Holder, Scope};

/// Proof that the request has the scope of `S`.
pub(super) struct RequireScope<S>(PhantomData<S>);

/// Proof that the request may detect persons.
pub(super) type RequireDetect = RequireScope<Detect>;
/// Proof that the request may read calibrations and reports.
pub(super) type RequireRead = RequireScope<Read>;
/// Proof that the request may change the calibrations and the cameras of the server.
pub(super) type RequireAdmin = RequireScope<Admin>;

/// Proof that the request may see the images of views.
pub(super) type RequireView = RequireScope<View>;

/// A required scope.
pub(super) trait RequiredScope {
    /// The scope of the key.
    const SCOPE: Scope;
}

/// Declares the required scopes.
macro_rules! required_scopes {
    ($($name:ident)+) => {$(
        #[doc = concat!("The marker of [`Require", stringify!($name), "`].")]
        pub(super) struct $name;

        impl RequiredScope for $name {
            const SCOPE: Scope = Scope::$name;
        }
    )+};
}

required_scopes! { Detect Read Admin View }

impl<S: RequiredScope> RequireScope<S> {
    fn check(
        state: &ApiState,
        headers: &HeaderMap,
        holder: Option<&Holder>,
    ) -> Result<Self, Problem> {
        let access = &state.options.access;
        access.check(headers, holder, None, S::SCOPE)?;
        Ok(Self(PhantomData))
    }

    /// Checks the scope of a request whose key may also be the password of Basic authentication, or
    /// `in_query`, but for the scope `admin`. Returns the holder of such a key.
    pub(super) fn with_key(
        state: &ApiState,
        headers: &HeaderMap,
        in_query: Option<&str>,
    ) -> Result<(Self, Option<Holder>), Problem> {
        let access = &state.options.access;
        let holder = access.identify(headers);
        let password = basic_password(headers);
        let elsewhere = in_query.or(password.as_deref());
        let elsewhere = elsewhere.filter(|_| S::SCOPE != Scope::Admin);
        let holder = access.check(headers, holder.as_ref(), elsewhere, S::SCOPE)?;
        Ok((Self(PhantomData), holder))
    }

    /// Checks the scope of a stream again: its key may have been removed.
    pub(super) fn check_again(state: &ApiState, headers: &HeaderMap) -> Result<Self, Problem> {
        let holder = state.options.access.identify(headers);
        Self::check(state, headers, holder.as_ref())
    }
}

impl<S: RequiredScope> FromRequestParts<ApiState> for RequireScope<S> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        let context = RequestContext::from_extensions(&parts.extensions)?;
        Self::check(state, &parts.headers, context.holder.as_ref())
    }
}
