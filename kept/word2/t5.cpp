#include "ext.hpp"
using F=Fidelity;
TruthRun full_truth(const Scene& s,std::vector<double> t,int mult){TruthRun o;o.t=t;Scene sc=s;sc.fidelity=F::kFull;sc.rate*=mult;Simulation sim(sc);Eigen::VectorXd m;Eigen::Matrix3Xd r;masses(s,m,r);
  for(double x:t){auto k=std::llround(x*sc.rate);while(sim.state.tick<k)sim.run(1);o.V.push_back(elastic_displacements(m,r,sim.positions_W()));}return o;}
// S5 feedback softens a local mode beyond the 16th
TEST(S,5){for(double part:{0.97,0.99})for(bool held:{true})for(double eps:{0.,1e-4,3e-4}){Scene s;double kP=2e4;int P=point(s,1.0,{0,0,0});std::vector<int> o;
  for(int a=0;a<3;++a)for(double g:{1.,-1.}){Vector3d p=Vector3d::Zero();p[a]=g;o.push_back(point(s,1.0+0.1*o.size(),p));}
  for(int i:o)link(s,{P,i},Spring{kP});
  for(int i=0;i<6;++i)for(int j=i+1;j<6;++j)link(s,{o[i],o[j]},Spring{300.+10*i+7*j});
  std::vector<int> ex;for(int k=0;k<5;++k){Vector3d p(1.3*std::cos(1.3*k+.3),1.2*std::sin(1.3*k+.3),0.9*((k%2)?1:-1));int e=point(s,1.,p);for(int i:{0,2,4,1,3,5})link(s,{e,o[i]},Spring{100.+9*k+3*i});}
  s.rate=2000;publish_all(s);s.damping.modal_ratio=0;auto S_=st(s);std::printf("omega:");for(int i=0;i<S_->omega.size();++i)std::printf(" %.1f",S_->omega[i]);std::printf("\n");
  if(held){int q[3]={P,o[2],o[3]};double c[3]={1,-.5,-.5};for(int i=0;i<3;++i)for(int j=0;j<3;++j){Feedback f;f.name="f"+std::to_string(3*i+j);f.point=q[i];f.sensor=q[j];f.displacement_gain=Vector3d(0,2*kP*part*c[i]*c[j],0).asDiagonal().toDenseMatrix();s.feedbacks.push_back(f);}}
  // ring P along y: velocity; start
  s.initial.points.push_back({P,Vector3d(0,2e-3,0),Vector3d::Zero()});for(int i:o)s.initial.points.push_back({i,Vector3d(0,-2e-4,0),Vector3d::Zero()});
  if(eps>0){Load L;L.axes=Axes::kBody;double T=eps*kP;L.forces={{o[0],{T,0,0}},{o[1],{-T,0,0}}};s.loads={L};}
  std::vector<double> t{0.05,0.2,0.5,1.0,1.5,2.,3.,4.};
  auto tr=full_truth(s,t,16),tr2=full_truth(s,t,1);double d=0,z=0;Eigen::VectorXd m;Eigen::Matrix3Xd r;masses(s,m,r);for(size_t k=0;k<t.size();++k){d=std::max(d,mean_size(tr.V[k]-tr2.V[k],m));z=std::max(z,mean_size(tr.V[k],m));}
  std::printf("S5 feedback %d eps %g: full x1 vs x4 %.1e\n",held,eps,d/z);
  for(auto rung:{F::kSeparated,F::kCoupled}){std::printf("== S5 %s\n",name_of(rung));judge_c(s,rung,tr,1);}}}
// S7 angular momentum of damped circular ringing
TEST(S,7){Scene s;double R=0.1;for(int k=0;k<3;++k)for(int c=0;c<3;++c)point(s,k==1?2.:1.,{k-1.0,R*std::cos(2*M_PI*c/3),R*std::sin(2*M_PI*c/3)});
  for(int k=0;k<3;++k)for(int c=0;c<3;++c)link(s,{3*k+c,3*k+(c+1)%3},Spring{2e4});
  for(int k=0;k<2;++k)for(int c=0;c<3;++c){link(s,{3*k+c,3*k+3+c},Spring{2e4});link(s,{3*k+c,3*k+3+(c+1)%3},Spring{2e4});link(s,{3*k+c,3*k+3+(c+2)%3},Spring{2e4});}
  publish_all(s);auto S_=st(s);double w=S_->omega[1];std::printf("omega %g %g %g max %g\n",S_->omega[0],S_->omega[1],S_->omega[2],S_->omega.maxCoeff());
  s.rate=S_->omega.maxCoeff()/0.5;s.damping.modal_ratio=0.01;for(double q:{1.5e-3,4e-3}){s.initial.points.clear();add_mode(s,*S_,1,q,0);add_mode(s,*S_,2,0,q*w);
  Load L;L.axes=Axes::kWorld;double f=0.5e-3*w*w;for(int c=0;c<3;++c){L.forces.push_back({c,{0,f,0}});L.forces.push_back({3+c,{0,-2*f,0}});L.forces.push_back({6+c,{0,f,0}});}s.loads={L};
  std::vector<double> t;for(double x:{20.,100.,300.,600.,1000.,1500.,2000.,2500.})t.push_back(x/w);
  show("S7",s,s,t,{F::kSpinLoaded,F::kCoupled});}}
TEST(S,8){std::mt19937_64 g(7);std::uniform_real_distribution<double>u(-1,1);Scene s;
  for(int k=0;k<6;++k)point(s,10,{2*std::cos(k*M_PI/3),2*std::sin(k*M_PI/3),0.8*((k%2)?1:-1)});int a=point(s,1,{-0.3,0.05,0}),b=point(s,1,{0.3,0,0.05});
  for(int i=0;i<6;++i){link(s,{a,i},Spring{300.+10*i});link(s,{b,i},Spring{320.+8*i});for(int j=i+1;j<6;++j)link(s,{i,j},Spring{200.+11*i+j});}link(s,{a,b},Spring{2e4});
  publish_all(s);s.pushable={a,b};s.rate=1000;s.damping.modal_ratio=0.02;s.force_limit=100;
  Vector3d n=(s.points[b].position-s.points[a].position).normalized();double f=5.;
  Scene truth=s;Load L;L.axes=Axes::kWorld;L.forces={{a,-f*n},{b,f*n}};truth.loads={L};
  ForceCommand c=make_command(0,1,Axes::kWorld);for(auto&p:L.forces)add_force(c,p.point,p.force);
  auto S_=st(s);for(int i=0;i<S_->omega.size();++i)std::printf(" %.3g",S_->omega[i]);std::printf("\n");
  for(double tol:{0.005,0.01,0.02}){Scene j=s;j.leave_out.tolerance=tol;j.leave_out.on_need=OnNeed::kRefuse;
  Faults ff;auto SS=build_structure(j,ff);auto pl=make_plan(j,*SS,ff);std::printf("tol %g modes %d of %d\n",tol,(int)pl->num_elastic,(int)SS->omega.size());for(auto&p:pl->parts)std::printf("  part share_per_force %g\n",p.share_per_force);
  show("S8",truth,j,{0.05,0.3,1.,3.,10.,20.},{F::kSeparated},{{0.0,c}});}}
TALLY
