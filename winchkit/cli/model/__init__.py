"""Commands that compare a model with runs: compare, diagnose, add, plan, calibrate, size.

Each reads runs and a profile by ``options``, calls one public function, and prints its result;
``undo``, ``remove`` and ``ledger`` edit a profile.
"""
