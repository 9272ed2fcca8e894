#!/bin/sh
# Runs rustdoc with its unstable options, for public_api.rs. The variable is not set for cargo itself, because
# that would build all dependencies again.
RUSTC_BOOTSTRAP=1 exec rustdoc "$@"
