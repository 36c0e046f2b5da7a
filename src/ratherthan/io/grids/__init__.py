"""Maps of cells enter (MovingAI, the ROS map server), Problems leave: a robot that drives from cell to cell."""
