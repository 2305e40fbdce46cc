"""nbgrader's configuration: this checkout is the course. What is graded goes to folders that git ignores."""

import os

c = get_config()  # nbgrader defines it

c.CourseDirectory.course_id = "labkit"
c.CourseDirectory.source_directory = "solutions"
c.CourseDirectory.release_directory = "labs"
if set("?#%") & set(os.getcwd()):  # nbgrader does not escape them in the address of its gradebook
    c.CourseDirectory.db_url = "sqlite:///gradebook.db"
c.CourseDirectory.ignore = [".ipynb_checkpoints", "*.pyc", "__pycache__", "feedback"]
# Whose a file is in a zip of Moodle's or Canvas's: downloaded/TOPIC/archive/ANY.zip, then `nbgrader zip_collect TOPIC`.
c.ZipCollectApp.extractor_plugin = "labgrader.handin.collect.LmsExtractor"
c.ZipCollectApp.collector_plugin = "labgrader.handin.collect.LmsCollector"
# `nbgrader autograde` and formgrader's Autograde refuse: `labkit grade` grades.
c.Autograde.exporter_class = "labgrader.grade.nbgrader_plugins.GradedByLabkit"
# Copies have rubrics for formgrader; nbgrader's feedback leaves them out.
c.GenerateFeedback.exporter_class = "labgrader.grade.nbgrader_plugins.FeedbackPages"
