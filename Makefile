# Targets for people. Everything is built in release, so that one set of
# dependencies is compiled once and serves the program, its tests and its lints.
#
#   make demo SECONDS=60 OUT=my-demo
#   CARGO_TARGET_DIR=/elsewhere make test

CARGO ?= cargo
SECONDS ?= 20
OUT ?=
ROOM ?=
# rustup's cargo, where the shell was opened before it was installed.
export PATH := $(PATH):$(HOME)/.cargo/bin

.DEFAULT_GOAL := help
.PHONY: help setup demo test quick lint release doc docs bench clean

help: ## list the targets
	@echo "truebead: keeps an extruded bead at its target width"
	@echo
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/  make \1 | \2/p' $(MAKEFILE_LIST) | \
		while IFS='|' read -r what does; do printf '%-14s%s\n' "$$what" "$$does"; done

setup: ## install what is missing to build it (Debian, Ubuntu), or name it
	@scripts/setup

demo: setup ## build it and run the whole loop with nothing attached (SECONDS=20, OUT=folder)
	$(CARGO) build --release --locked
	$(CARGO) run --release --locked --quiet -- demo --seconds $(SECONDS) $(if $(OUT),--out "$(OUT)")

test: setup lint ## format, lints, every test, and the links of all documents
	$(CARGO) test --release --locked --workspace
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --locked --no-deps --document-private-items

quick: setup ## unit tests of one room soon after a change (ROOM=vision)
	@scripts/quick "$(ROOM)"

release: setup ## the program stripped, its debug information beside it: target/dist
	@scripts/release

lint: setup
	$(CARGO) fmt --all --check
	$(CARGO) clippy --release --locked --workspace --all-targets -- -D warnings

doc: setup ## the library's documentation as pages
	$(CARGO) doc --release --locked --no-deps

# mdBook, of a fixed version and without what only its web server needs. It goes into the
# project's own folder; nothing but this target needs it.
MDBOOK_VERSION := 0.5.2
MDBOOK := target/tools/bin/mdbook

$(MDBOOK):
	$(CARGO) install mdbook --locked --version $(MDBOOK_VERSION) --no-default-features --features search --root target/tools

docs: $(MDBOOK) ## the book as pages: docs/book/index.html
	$(MDBOOK) build docs

bench: setup ## how fast measurement, control and rendering are on this machine
	$(CARGO) bench --locked --benches

clean: ## delete what was built
	$(CARGO) clean
