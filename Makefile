# softgrip: each target is an artifact, each rule one stage. `make help` lists them.
#
#   RUN=name       which runs/<name>/run.toml        (default: default)
#   MESH_DIR=path  folder of meshes for the dataset  (default: the embedded object set)
#   WORKERS=n      worker processes                  (default: all cores)
#   EXECUTOR=ray   on an existing Ray cluster        (default: local processes)
#   RANKS=n        processes that train one network  (default: 1; a GPU each where there are any)

RUN     ?= default
PYTHON3 ?= python3
R       := runs/$(RUN)
STATE   := $(R)/.state
PY      := .venv/bin/python
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.SUFFIXES:
.NOTPARALLEL:

# Without MESH_DIR, the goals that make a dataset take the embedded objects, and
# those that use one (train, eval, ...) stay with the meshes it was made from.
ifeq (,$(filter dataset objects scenes grasps shards bench holdout,$(MAKECMDGOALS) $(GOAL)))
MESH_DIR := $(or $(MESH_DIR),$(shell cat $(STATE)/mesh_dir 2>/dev/null))
endif
export RUN MESH_DIR WORKERS SQL
ifeq (,$(strip $(MESH_DIR)))
unexport MESH_DIR
endif
ifeq (,$(strip $(WORKERS)))
unexport WORKERS
endif

.PHONY: help dataset objects scenes grasps shards train sweep eval evaluate status doctor setup reader s3 pull test bench gallery scenarios referee holdout folds release review report export predict real sensors calibrate live robot board docs lint fuzz regress plan list prune seal unseal query diff publish expect clean FORCE

help:  ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## /{printf "  make %-10s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))
	@echo "  RUN=ci|default|paper, MESH_DIR=folder of meshes, WORKERS=processes"

dataset: $(R)/shards.mcap  ## objects, scenes, grasps, shards
	@$(PY) -m stages.freshness fresh shards
train: $(R)/train.mcap  ## GA-CNN on the dataset
	@$(PY) -m stages.freshness fresh train
eval: $(R)/evaluate.mcap  ## closed-loop success by level
	@$(PY) -m stages.evaluate --table

sweep: $(R)/sweep.mcap  ## the GA-CNN family compared (Fig. 1), and what its parts buy
	@$(PY) -m stages.freshness fresh sweep

objects: $(R)/objects.mcap  ## stage 1: meshes to catalogue
scenes: $(R)/scenes.mcap  ## stage 2: clutter, settled and rendered
grasps: $(R)/grasps.mcap  ## stage 3: labelled grasps
shards: $(R)/shards.mcap  ## stage 4: shuffled, split shards
evaluate: eval

# --- one rule a stage: an artifact is remade when its key file is newer ---
$(R)/%.mcap: $(STATE)/%.key
	@$(PY) -m stages.$* --run $(RUN)

# Several processes train one network where RANKS says so.
ifneq (,$(strip $(RANKS)))
$(R)/train.mcap: $(STATE)/train.key
	@$(PY) -m torch.distributed.run --standalone --nproc-per-node=$(RANKS) -m -- stages.train --run $(RUN)
endif

# A key file is looked at every time and rewritten only when its digest changed.
$(STATE)/%.key: .venv/.ready FORCE
	@GOALS="$(MAKECMDGOALS)" $(PY) -m stages.freshness key $*
$(STATE)/scenes.key: $(R)/objects.mcap
$(STATE)/grasps.key: $(R)/scenes.mcap
$(STATE)/shards.key: $(R)/grasps.mcap
$(STATE)/train.key: $(R)/shards.mcap
$(STATE)/evaluate.key: $(R)/train.mcap
$(STATE)/sweep.key: $(R)/shards.mcap
.PRECIOUS: $(STATE)/%.key $(R)/%.mcap
FORCE:

status: .venv/.ready  ## what is stale, and why; with EXECUTOR=ray what the cluster's nodes have
	@$(PY) -m stages.freshness status
	@$(PY) -m stages.store look
	@$(if $(filter ray,$(EXECUTOR)),$(PY) -m stages.cluster)
pull: .venv/.ready  ## bring RUN from its object store (RUN_STORE=s3://bucket/prefix, or run.toml) to its folder
	@$(PY) -m stages.store pull

plan: .venv/.ready  ## what 'make GOAL' will do, about how long and how much disk: GOAL=dataset|train|eval
	@$(PY) -m stages.freshness plan $(or $(GOAL),eval)

query: .venv/.ready  ## ask RUN in SQL: SQL="SELECT ..." [OUT=file.csv|.parquet SHOW=1]; without SQL the tables
	@$(PY) -m stages.query $(if $(OUT),--out "$(OUT)") $(if $(SHOW),--show)

# --- many runs ---
list: .venv/.ready  ## every run: disk, stages, headline figures, stale or not, what it was made from
	@$(PY) -m stages.runs list
prune: .venv/.ready  ## what can be made again, of all runs; FREE=1 deletes it
	@$(PY) -m stages.runs prune $(if $(FREE),--free)
diff: .venv/.ready  ## what differs between two runs, and what is chance: A=run B=run, to runs/<A>/diff-<B>
	@test -n "$(A)" -a -n "$(B)" || { echo "Name two runs: make diff A=run B=run"; exit 1; }
	@A="$(A)" B="$(B)" $(PY) -m stages.diff
expect: .venv/.ready  ## what must hold of RUN's artifacts, and whether it does
	@$(PY) -m stages.expect
seal: .venv/.ready  ## finish RUN: nothing in it is made anew, here or on another machine
	@$(PY) -m stages.runs seal
unseal: .venv/.ready  ## take the seal off RUN
	@$(PY) -m stages.runs unseal

# --- the machine ---
setup: .venv/.ready  ## virtual environment, pinned packages, Vulkan driver
.venv/.ready: constraints.txt pyproject.toml
	@test -x $(PY) || $(PYTHON3) -m venv .venv || \
	  { echo "No virtual environment could be made: apt-get install python3-venv"; exit 1; }
	$(PY) -m pip install --quiet --disable-pip-version-check -c constraints.txt --editable '.[test]'
	@$(PY) -m pipeline.machine.vulkan_driver
	@touch $@

# The MCAP project's own TypeScript reader, by which the tests check what we write.
NODE_READER := tests/artifacts/node/node_modules/.package-lock.json
reader: $(NODE_READER)
$(NODE_READER): tests/artifacts/node/package-lock.json
	@if command -v npm >/dev/null; then \
	  npm ci --prefix $(<D) --ignore-scripts --no-audit --no-fund --silent && touch $@; \
	else echo "npm is not installed: artifacts are not checked by the TypeScript reader"; fi

# The S3 server that the tests speak to, in an environment of its own: see its requirements.
S3 := tests/artifacts/s3
s3: $(S3)/.venv/.ready
$(S3)/.venv/.ready: $(S3)/requirements.txt
	@$(PYTHON3) -m venv $(@D) && \
	  $(@D)/bin/python -m pip install --quiet --disable-pip-version-check -r $< && touch $@ || \
	  echo "The S3 server could not be installed: the tests that speak to it are skipped"

doctor:  ## what is present, what is missing, how to mend it
	@$$(test -x $(PY) && echo $(PY) || echo $(PYTHON3)) -m pipeline.machine.doctor

test: .venv/.ready lint reader s3  ## lint, types, tests
	OMP_WAIT_POLICY=PASSIVE $(PY) -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

bench: .venv/.ready  ## speed of labelling, QP, storage and control, to runs/bench/bench.json
	@$(MAKE) --no-print-directory scenes RUN=bench
	@$(PY) -m stages.bench

TRIALS ?= 10
scenarios: .venv/.ready  ## failure modes of Supplement VIII, NETWORK=released|file, TRIALS=n, to runs/<run>/scenarios.md
	@NETWORK="$(NETWORK)" TRIALS=$(TRIALS) $(PY) -m stages.scenarios

referee: .venv/.ready  ## label, p and RUN's network against what the referee finds borne, to runs/<run>/referee
	@$(PY) -m stages.referee prepare
	@$(MAKE) --no-print-directory grasps RUN=$(RUN)/referee
	@$(PY) -m stages.referee judge

holdout: .venv/.ready  ## NETWORK=released|file on MESH_DIR, nothing trained, to runs/<run>/holdout
	@NETWORK="$(NETWORK)" $(PY) -m stages.holdout prepare
	@$(MAKE) --no-print-directory grasps RUN=$(RUN)/holdout
	@$(PY) -m stages.evaluate --run $(RUN)/holdout
	@$(PY) -m stages.holdout measure

FOLDS ?= 5
folds: .venv/.ready  ## cross-validation over families, FOLDS=k, to runs/<run>/folds
	@FOLDS=$(FOLDS) $(PY) -m stages.folds prepare
	@$(MAKE) --no-print-directory objects RUN=$(RUN)/folds
	@FOLDS=$(FOLDS) $(PY) -m stages.folds deal
	@for fold in $$(seq 0 $$(($(FOLDS) - 1))); do \
	  $(PY) -m stages.scenes --run $(RUN)/folds/fold-$$fold && \
	  $(PY) -m stages.grasps --run $(RUN)/folds/fold-$$fold || exit 1; done
	@FOLDS=$(FOLDS) $(PY) -m stages.folds measure

release: .venv/.ready  ## RUN's network in the place of the released one, with baseline and figures
	@RUN=$(RUN) $(PY) -m stages.release

gallery: .venv/.ready  ## the nine levels on one sheet, to runs/<run>/gallery.png
	@$(PY) -m stages.gallery

review: .venv/.ready  ## recordings of RUN (of STAGE alone) in the Rerun viewer
	@STAGE=$(STAGE) $(PY) -m stages.review

report: .venv/.ready  ## the run on one page, to runs/<run>/report.html and report.md
	@$(PY) -m stages.report

export: .venv/.ready  ## dataset as FORMAT=acronym|graspgen|webdataset|parquet|bop|usd|lerobot, to runs/<run>/export
	@FORMAT=$(or $(FORMAT),acronym) $(PY) -m stages.export

publish: .venv/.ready  ## dataset as a folder for a dataset hub or an archive, to runs/<run>/publish
	@$(PY) -m stages.publish

PREDICT_OPTIONS = $(foreach option,camera colour mask instances workspace depth-scale-m radius-mm tilt-deg top out,\
  $(if $($(subst -,_,$(option))),--$(option) "$($(subst -,_,$(option)))"))
predict: .venv/.ready  ## grasps on a real picture: DEPTH=file [camera=file mask=file tilt_deg=90 ...]
	@test -n "$(DEPTH)" || { echo "Give the picture: make predict DEPTH=file.depth.png"; exit 1; }
	@$(PY) -m stages.predict $(DEPTH) $(PREDICT_OPTIONS)

sensors: .venv/.ready  ## noise fitted to one camera's real frames: FRAMES=folder [names='bin_*' name=... scenes=12 grasps=40]
	@test -n "$(FRAMES)" || { echo "Give the frames: make sensors FRAMES=folder"; exit 1; }
	@$(PY) -m stages.sensors $(FRAMES) $(foreach option,name names scenes grasps,$(if $($(option)),--$(option) "$($(option))"))

real: .venv/.ready  ## on real frames: FRAMES=folder [tilt_deg=90 ...]; q-hat against tried grasps: ATTEMPTS=files; to runs/<run>/real
	@test -n "$(FRAMES)$(ATTEMPTS)" || { echo "Give the frames, or logged attempts: make real FRAMES=folder, make real ATTEMPTS=folder"; exit 1; }
	@test -z "$(FRAMES)" || $(PY) -m stages.real $(FRAMES) $(foreach option,tilt-deg radius-mm out,$(if $($(subst -,_,$(option))),--$(option) "$($(subst -,_,$(option)))"))
	@test -z "$(ATTEMPTS)" || $(PY) -m stages.tried $(ATTEMPTS) $(if $(out),--out "$(out)")

calibrate: .venv/.ready  ## from which q-hat on RUN's network (or NETWORK) is right, to runs/<run>/calibration.json
	@$(PY) -m stages.calibrate

live: .venv/.ready  ## grasps on every depth picture of a bag in recorded time: BAG=file.mcap [topic=/depth ...]
	@test -n "$(BAG)" || { echo "Give the bag: make live BAG=file.mcap"; exit 1; }
	@$(PY) -m stages.live $(BAG) $(foreach option,topic depth-scale-m radius-mm tilt-deg out,$(if $($(subst -,_,$(option))),--$(option) "$($(subst -,_,$(option)))"))

robot: .venv/.ready  ## attempts on a robot: DRIVER=file.py CALIBRATION=file.json [attempts=10 ...], to runs/<run>/robot
	@test -n "$(DRIVER)" -a -n "$(CALIBRATION)" || { echo "Give both: make robot DRIVER=my_robot.py CALIBRATION=cell.json"; exit 1; }
	@$(PY) -m stages.robot $(DRIVER) $(CALIBRATION) $(foreach option,attempts radius-mm policy out,$(if $($(subst -,_,$(option))),--$(option) "$($(subst -,_,$(option)))"))

board: .venv/.ready  ## a board to print; with POSES=file.json CALIBRATION=file.json the residue of hand-eye, to runs/<run>/board
	@$(PY) -m stages.board runs/$(RUN)/board $(if $(POSES),--poses "$(POSES)") $(if $(CALIBRATION),--calibration "$(CALIBRATION)") $(if $(square_mm),--square-mm "$(square_mm)")

docs: .venv/.ready  ## the pages and a reference of every module as a site, to runs/docs
	@$(PY) -m stages.docs

lint: .venv/.ready
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	.venv/bin/lint-imports --no-logo
	.venv/bin/pydoclint --quiet pipeline stages
	$(PY) -m schemas.generate --check

# Run ci on the embedded objects, whatever MESH_DIR says: they are the same everywhere.
# AFRESH=sapien|embree compares what is made anew with that renderer, without the closed loop.
regress:  ## run ci held against its reference; ACCEPT=1 renews the reference
	@$(MAKE) --no-print-directory runs/ci/$(if $(AFRESH),objects,evaluate).mcap RUN=ci MESH_DIR=
	@$(PY) -m stages.regress $(if $(AFRESH),--afresh $(AFRESH)) $(if $(ACCEPT),--accept)

SECONDS_A_READER ?= 60
fuzz: .venv/.ready  ## coverage-guided fuzzing of the readers, SECONDS_A_READER each
	@for reader in mesh toml mcap checkpoint; do \
	  $(PY) -m tests.fuzz $$reader --seconds $(SECONDS_A_READER) || exit 1; done

clean:  ## remove what run RUN produced, keep run.toml, families.toml, masses.toml and a robot's attempts
	find $(R) -mindepth 1 ! -name run.toml ! -name families.toml ! -name masses.toml ! -path '$(R)/robot' ! -path '$(R)/robot/*' -delete
