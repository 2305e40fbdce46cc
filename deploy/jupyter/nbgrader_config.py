"""nbgrader for everybody on the hub: where labs are fetched and handed in, and whose a submission is."""

import os

c = get_config()  # nbgrader defines it

c.CourseDirectory.course_id = "labkit"
c.Exchange.root = os.environ["LABKIT_EXCHANGE"]
# What its owner did not hand in is not collected.
c.ExchangeFactory.collect = "labgrader.handin.exchange.OwnersCollect"
if "JUPYTERHUB_USER" in os.environ:
    c.CourseDirectory.student_id = os.environ["JUPYTERHUB_USER"]
