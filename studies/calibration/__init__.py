"""What the simulated rig cannot know, drawn from priors and held against the figures of Karl et al. 2016.

``calibration.yaml`` is the procedure, ``results/`` what it gave, ``results/tables.md`` its tables,
docs/calibration.md its page. From a checkout:

    python -m studies.calibration                          write the tables from results/
    python -m studies.calibration --draw --jobs 2 --out DIR    draw anew: DIR/draws.csv, variations.csv and run.json
"""
