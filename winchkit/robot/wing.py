"""What the core looks up of robots."""

from __future__ import annotations

from winchkit.wings import Wing

WING = Wing(
    kinds={
        "robot": "winchkit.robot.files.profile:robot",
        "robot-programme": "winchkit.robot.files.profile:programme",
    },
    parts={
        "wired_robot": "winchkit.robot.bench.wired:wired_robot",
        "live_robot": "winchkit.robot.web.live_robot:LiveRobot",
        "changes": "winchkit.robot.effects.reference:robot_changes",
        "simulated_profiles": "winchkit.robot.sim.build:profiles_of",
        "simulated": "winchkit.robot.sim.live:LivePlatform",
    },
    calls={
        "RobotProfile": {
            "add": "winchkit.robot.diagnosis.add:fitted_addition",
            "check": "winchkit.robot.cli.check:faults_and_warnings",
            "check_effects": "winchkit.robot.effects.bind:check_robot",
            "compare": "winchkit.robot.diagnosis.compare:compared",
            "diagnose": "winchkit.robot.diagnosis.diagnose:diagnose",
            "export_model": "winchkit.robot.export.export:export_model",
            "plan_command": "winchkit.robot.cli.plan:tell_poses",
            "remove": "winchkit.robot.diagnosis.add:remove",
        },
        "RobotWiring": {"check": "winchkit.robot.cli.check:clearance_at_home"},
        "RobotProgramme": {
            "execute": "winchkit.robot.bench.programme:run_robot_programme",
            "preview": "winchkit.robot.web.programmes:preview",
            "record": "winchkit.robot.cli.simulated:record_robot",
            "run_command": "winchkit.robot.cli.run:run_robot",
        },
        "RobotAnswer": {
            "figures": "winchkit.robot.report.diagnosis:report_figures",
            "html": "winchkit.robot.report.diagnosis:report_html",
            "json": "winchkit.robot.report.pose_traces:traces_json",
            "limits": "winchkit.robot.report.data:limits",
            "plan": "winchkit.robot.diagnosis.plan:plan",
            "unexplained": "winchkit.robot.report.pose_traces:unexplained_curve",
        },
        "RobotCompared": {
            "figures": "winchkit.robot.report.diagnosis:comparison_figures",
            "html": "winchkit.robot.report.diagnosis:comparison_html",
        },
        "RobotDataset": {
            "runs_table": "winchkit.robot.report.data:runs_table",
            "size_text": "winchkit.robot.report.data:size_text",
        },
        "FittedRobotAddition": {
            "figures": "winchkit.robot.report.diagnosis:addition_figures",
            "html": "winchkit.robot.report.diagnosis:addition_html",
        },
    },
    commands={
        "Model and runs": {
            "calibrate": (
                "winchkit.robot.cli.calibrate",
                "Calibrate a cable robot from measured poses.",
            ),
            "workspace": (
                "winchkit.robot.cli.workspace",
                "Compute where a cable robot's cables hold its platform.",
            ),
        },
        "Bench": {
            "hold-platform": (
                "winchkit.robot.cli.hold_platform",
                "Hold cable forces and pose of a robot by its cells and tracker.",
            )
        },
    },
    effects=("winchkit.robot.effects.on_robot",),
    renderers=("winchkit.robot.report.notebook",),
    views=("winchkit.robot.web.view:RobotView",),
)
